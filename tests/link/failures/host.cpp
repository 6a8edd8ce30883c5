#include "tests/link/failures/host.hpp"

#include <fcntl.h>
#include <signal.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <string_view>
#include <utility>

#include "tests/link/failures/command.hpp"

namespace arbiter::failures {

std::string program(const char* name) { return std::string(ARBITER_PROGRAMS) + "/" + name; }

std::string own_program() { return std::filesystem::read_symlink("/proc/self/exe"); }

test::Daemon::Options FailingHost::daemon_options(const Plan& plan, unsigned number,
                                                  const std::string& runtime,
                                                  const std::string& directory) {
  test::Daemon::Options options;
  options.instance = instance_of(number);
  options.runtime_directory = runtime;
  for (unsigned model = 1; model < kModels.size(); ++model) {
    if (model + 1 == kModels.size() && number == plan.host_without) continue;
    const std::string path = directory + "/" + options.instance + "." + kModels[model] + ".xml";
    std::ofstream(path) << plan.model_text(number, model);
    options.arguments.insert(options.arguments.end(),
                             {"--model", std::string(kModels[model]) + "=" + path});
  }
  return options;
}

FailingHost::FailingHost(const Plan& plan, unsigned number, const std::string& runtime,
                         std::string directory)
    : plan_(plan),
      number_(number),
      directory_(std::move(directory)),
      network_(number),
      daemon_(plan.model_text(number, 0), daemon_options(plan, number, runtime, directory_)) {
  recorder_ =
      start({program("arbiter"), "record", "--instance", name(), "-o", recording(), "--payloads",
             plan.has_losers ? kSmallOnly : "all", "--compression", "lz4", "--period", "5ms"},
            "recorder");
  start_link();
  start_component();
  if (plan.speakers.count(number) != 0) start_rival();
}

test::ChildProcess FailingHost::start(std::vector<std::string> command,
                                      const std::string& log) const {
  const std::string path = directory_ + "/" + name() + "." + log + ".log";
  const shm::FileDescriptor file(
      ::open(path.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600));
  return {command, {{"CYCLONEDDS_URI", std::nullopt}}, {-1, file.get(), file.get()}};
}

void FailingHost::start_link() {
  std::vector<std::string> command = network_.enter();
  command.insert(command.end(), {program("arbiter-link"), "--instance", name(), "--host", name(),
                                 "--interface", "eth0"});
  link_since_ = now();
  if (!without_link_.empty()) without_link_.back().to = link_since_;
  link_ = start(std::move(command), "link");
}

void FailingHost::kill_link() {
  if (without_link_.empty() || without_link_.back().to != 0) expect_death_of_link();
  link_.kill();
}

test::ChildProcess FailingHost::start_component(std::uint32_t life, bool is_rival) const {
  std::vector<std::string> command{own_program(),
                                   "--component",
                                   name(),
                                   "--number",
                                   std::to_string(number_),
                                   "--life",
                                   std::to_string(life),
                                   "--seed",
                                   std::to_string(plan_.seed),
                                   "--period",
                                   std::to_string(plan_.period)};
  if (is_rival) command.emplace_back("--rival");
  return start(std::move(command), "component");
}

void FailingHost::start_component() {
  lives_.push_back(now());
  component_ = start_component(static_cast<std::uint32_t>(lives_.size()), false);
}

void FailingHost::start_rival() {
  rivals_.push_back({static_cast<std::uint32_t>(rivals_.size() + 1), {now(), 0}, false});
  rival_ = start_component(rivals_.back().life, true);
}

// One that cannot go yet, because nobody opens its port for it, is not waited for.
void FailingHost::end_rival(bool abruptly) {
  if (!rival_.runs()) return;
  rivals_.back().span.to = now();
  rivals_.back().is_abrupt = abruptly;
  if (abruptly) {
    rival_.kill();
  } else {
    rival_.signal(SIGTERM);
    former_rivals_.push_back(std::exchange(rival_, {}));
  }
}

std::vector<pid_t> FailingHost::pids() const {
  std::vector<pid_t> result;
  for (const auto* each : {&link_, &component_, &rival_}) {
    if (each->runs()) result.push_back(each->pid());
  }
  return result;
}

HostHistory FailingHost::history() {
  return {link_since_, without_link_, rivals_, imports(), lives_};
}

std::vector<Import> FailingHost::imports() {
  std::vector<Import> result(plan_.hosts.size());
  const nlohmann::json status = daemon_.status();
  for (const auto& source : status["sources"]) {
    for (unsigned other = 1; other <= result.size(); ++other) {
      if (other == number_ || source["name"] != source_of(other)) continue;
      const std::uint64_t arrived =
          source.value("published", std::uint64_t{0}) + source.value("signals", std::uint64_t{0});
      result[other - 1] = {arrived, source.value("described", "")};
    }
  }
  return result;
}

void FailingHost::end(Findings& found) {
  std::vector<std::pair<test::ChildProcess*, const char*>> all{{&component_, "component"}};
  if (rival_.runs()) all.emplace_back(&rival_, "rival");
  for (test::ChildProcess& each : former_rivals_) all.emplace_back(&each, "rival");
  all.insert(all.end(), {{&link_, "link"}, {&recorder_, "recorder"}});
  for (const auto& [process, what] : all) {
    process->signal(SIGTERM);
    const int status = process->wait();
    // A rival may be ended before it listens.
    const bool is_early = status == 128 + SIGTERM && std::string_view(what) == "rival";
    if (status != 0 && !is_early) {
      found.push_back(name() + ": its " + what + " ended with " + std::to_string(status));
    }
  }
}

void FailingHost::add_seen_by_component(Findings& found) const {
  std::ifstream log(directory_ + "/" + name() + ".component.log");
  for (std::string line; std::getline(log, line);) {
    if (line.rfind("FOUND ", 0) == 0) found.push_back(line.substr(6));
  }
}

}  // namespace arbiter::failures
