#include "tests/link/failures/host.hpp"

#include <fcntl.h>
#include <signal.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <utility>

#include "tests/link/failures/command.hpp"

namespace arbiter::failures {
namespace {

test::Daemon::Options daemon_options(unsigned number, const std::string& runtime) {
  test::Daemon::Options options;
  options.instance = instance_of(number);
  options.runtime_directory = runtime;
  return options;
}

std::string program(const char* name) { return std::string(ARBITER_PROGRAMS) + "/" + name; }

}  // namespace

FailingHost::FailingHost(const Plan& plan, unsigned number, const std::string& runtime,
                         std::string directory)
    : plan_(plan),
      number_(number),
      directory_(std::move(directory)),
      network_(number),
      daemon_(plan.model_text(number), daemon_options(number, runtime)) {
  recorder_ = start({program("arbiter"), "record", "--instance", name(), "-o", recording(),
                     "--payloads", "all", "--compression", "lz4", "--period", "5ms"},
                    "recorder");
  start_link();
  start_component();
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
  without_link_.push_back({now(), 0});
  link_.kill();
}

void FailingHost::start_component() {
  component_ =
      start({std::filesystem::read_symlink("/proc/self/exe"), "--component", name(), "--number",
             std::to_string(number_), "--life", std::to_string(++life_), "--seed",
             std::to_string(plan_.seed), "--period", std::to_string(plan_.period)},
            "component");
}

std::vector<FailingHost::Import> FailingHost::imports() {
  std::vector<Import> result(plan_.hosts.size());
  const nlohmann::json status = daemon_.status();
  for (const auto& source : status["sources"]) {
    for (unsigned other = 1; other <= result.size(); ++other) {
      if (other == number_ || source["name"] != source_of(other)) continue;
      result[other - 1] = {source.value("published", std::uint64_t{0}),
                           source.value("described", "")};
    }
  }
  return result;
}

void FailingHost::end(Findings& found) {
  for (const auto& [process, what] :
       {std::pair{&component_, "component"}, {&link_, "link"}, {&recorder_, "recorder"}}) {
    process->signal(SIGTERM);
    const int status = process->wait();
    if (status != 0) {
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

std::uint64_t counted_in(const std::string& described) {
  constexpr std::array<const char*, 6> kCounts{" lost",
                                               " late",
                                               " before the port was open",
                                               " withheld though they were wanted",
                                               " unreadable",
                                               " without memory"};
  std::uint64_t sum = 0;
  for (const char* const count : kCounts) {
    const std::size_t end = described.find(count);
    if (end == std::string::npos) continue;
    sum += std::stoull(described.substr(described.rfind(' ', end - 1) + 1));
  }
  return sum;
}

}  // namespace arbiter::failures
