#include "tests/link/failures/operators.hpp"

#include <poll.h>
#include <signal.h>
#include <sys/mman.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <random>
#include <system_error>
#include <utility>

#include "cli/switch_everywhere.hpp"
#include "wire/link_call.hpp"

namespace arbiter::failures {
namespace {

std::string content_of(int file) {
  std::string text;
  std::array<char, 4096> part;
  for (off_t at = 0;;) {
    const ssize_t size = ::pread(file, part.data(), part.size(), at);
    if (size <= 0) return text;
    text.append(part.data(), static_cast<std::size_t>(size));
    at += size;
  }
}

}  // namespace

void Operators::start(const FailingHost& at, unsigned model) {
  start(at, model,
        {program("arbiter"), "switch", kModels[model], "--all", "--json", "--instance", at.name()},
        0);
}

void Operators::start_killer(const FailingHost& at, unsigned model, FailingHost& victim) {
  start(at, model,
        {own_program(), "--component", at.name(), "--switch", kModels[model], "--kill",
         std::to_string(victim.link().pid())},
        victim.number());
}

void Operators::start(const FailingHost& at, unsigned model, std::vector<std::string> command,
                      unsigned victim) {
  One one;
  one.tried.host = at.number();
  one.tried.model = model;
  one.tried.victim = victim;
  one.output.reset(::memfd_create("report", MFD_CLOEXEC));
  if (!one.output) throw std::system_error(errno, std::generic_category(), "memfd_create");
  one.tried.span.from = now();
  one.process = test::ChildProcess(command, {}, {-1, one.output.get(), -1});
  ongoing_.push_back(std::move(one));
}

bool Operators::has_killer() const {
  for (const One& one : ongoing_) {
    if (one.tried.victim != 0) return true;
  }
  return false;
}

std::vector<SwitchTried> Operators::end() {
  reap(true);
  return std::move(ended_);
}

void Operators::reap(bool all) {
  for (std::size_t i = 0; i < ongoing_.size();) {
    One& one = ongoing_[i];
    pollfd ended{one.process.descriptor(), POLLIN, 0};
    if (::poll(&ended, 1, all ? -1 : 0) != 1) {
      ++i;
      continue;
    }
    one.tried.exit_code = one.process.wait();
    one.tried.span.to = now();
    one.tried.report = content_of(one.output.get());
    ended_.push_back(std::move(one.tried));
    ongoing_.erase(ongoing_.begin() + static_cast<std::ptrdiff_t>(i));
  }
}

int switch_and_kill(const std::string& instance, const std::string& model, int pid) {
  std::random_device random;
  const wire::SwitchRequest request{std::uint64_t{random()} << 32 | random() | 1, model, {}};
  wire::LinkCall link(instance);
  const auto ask = [&](const std::string& verb, const std::string& text) {
    if (verb == wire::kCommitVerb) ::kill(pid, SIGKILL);
    return link.ask_hosts({wire::kAllHosts, verb, text});
  };
  const auto look = [&] {
    ::poll(nullptr, 0, 250);  // as arbiter does
    return wire::read_hosts(link.ask({"", "hosts"}));
  };
  const auto result = cli::switch_everywhere(request, ask, look);
  cli::write_json(result, model);
  return cli::exit_code_of(result);
}

}  // namespace arbiter::failures
