#include "bench/harness/hosts.hpp"

#include <fcntl.h>
#include <sched.h>

#include <array>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <utility>

#include <nlohmann/json.hpp>

#include "shm/file_descriptor.hpp"

namespace arbiter::bench {
namespace {

std::string network_of(pid_t pid) { return "/proc/" + std::to_string(pid) + "/ns/net"; }

constexpr int kMaxHosts = 60;

std::string address_of(int host) { return "10.77.0." + std::to_string(host); }

// Two decimal digits are hexadecimal ones, too.
std::string hardware_address_of(int host) {
  return std::string("02:00:0a:4d:00:") + (host < 10 ? "0" : "") + std::to_string(host);
}

}  // namespace

NetworkSpace::NetworkSpace()
    : holder_({"/usr/bin/unshare", "-n", "/bin/sleep", "infinity"}, {},
              directory_.path() + "/log") {
  const auto mine = std::filesystem::read_symlink("/proc/self/ns/net");
  std::error_code ended;
  await_in_a_minute("a network of its own", [&] {
    if (holder_.ends_within(std::chrono::milliseconds(0))) {
      throw BenchError("networks for hosts can be made by root only");
    }
    const auto its = std::filesystem::read_symlink(network_of(holder_.pid()), ended);
    return !ended && its != mine;
  });
  ip("link set lo up");
}

std::vector<std::string> NetworkSpace::enter() const {
  return {"/usr/bin/nsenter", "--net=" + network_of(holder_.pid())};
}

void NetworkSpace::move_in() const {
  const shm::FileDescriptor network(
      ::open(network_of(holder_.pid()).c_str(), O_RDONLY | O_CLOEXEC));
  if (network.get() < 0 || ::setns(network.get(), CLONE_NEWNET) != 0) {
    throw BenchError("cannot enter the network of a host");
  }
}

void NetworkSpace::ip(const std::string& words) const {
  std::vector<std::string> command = enter();
  command.insert(command.end(), {"/bin/sh", "-c", "exec /usr/sbin/ip " + words});
  Program program(command, {}, directory_.path() + "/log");
  if (!program.ends_within(std::chrono::seconds(20)) || program.exit_code() != 0) {
    throw BenchError("ip " + words + " failed; is iproute2 installed?");
  }
}

std::uint64_t NetworkSpace::bytes() const {
  std::ifstream stream("/proc/" + std::to_string(holder_.pid()) + "/net/dev");
  for (std::string line; std::getline(stream, line);) {
    std::uint64_t received = 0;
    std::uint64_t sent = 0;
    if (std::sscanf(line.c_str(), " eth0: %lu %*u %*u %*u %*u %*u %*u %*u %lu", &received, &sent) ==
        2) {
      return received + sent;
    }
  }
  throw BenchError("a host has no eth0");
}

std::string declared(const std::vector<std::string>& sources) {
  std::string text;
  for (const std::string& each : sources) text += "<source port=\"" + each + "\"/>\n";
  return text;
}

NetworkSwitch::NetworkSwitch() {
  place_.ip("link add switch0 type bridge");
  place_.ip("link set switch0 up");
}

void NetworkSpace::know_neighbours(int count) const {
  const std::string file = directory_.path() + "/neighbours";
  {
    std::ofstream stream(file);
    for (int i = 1; i <= count; ++i) {
      stream << "neigh replace " << address_of(i) << " lladdr " << hardware_address_of(i)
             << " dev eth0 nud permanent\n";
    }
  }
  ip("-batch " + file);
}

void NetworkSwitch::connect(const NetworkSpace& space) {
  const int number = ++connected_;
  if (number > kMaxHosts) throw BenchError("a switch has no more places");
  const std::string port = "port" + std::to_string(number);
  place_.ip("link add " + port + " type veth peer name eth0 address " +
            hardware_address_of(number) + " netns " + std::to_string(space.holder()));
  place_.ip("link set " + port + " master switch0 up");
  space.ip("addr add " + address_of(number) + "/24 dev eth0");
  space.ip("link set eth0 up");
  space.know_neighbours(kMaxHosts);
}

LinkedHost::LinkedHost(std::string name, const std::string& model, NetworkSwitch& on)
    : name_(std::move(name)), robot_(model) {
  on.connect(space_);
}

void LinkedHost::start_link() {
  std::vector<std::string> command = space_.enter();
  command.insert(command.end(), {program_directory() + "/arbiter-link", "--interface", "eth0",
                                 "--host", name_, "--instance", Robot::kInstance});
  link_ =
      Program(command, {{"XDG_RUNTIME_DIR", robot_.runtime_directory()}, {"CYCLONEDDS_URI", {}}},
              robot_.runtime_directory() + "/link.log");
}

void LinkedHost::await_imported(int count) const {
  int now = 0;
  try {
    await_in_a_minute(std::to_string(count) + " imports",
                      [&] { return (now = imported()) == count; });
  } catch (const BenchError& error) {
    std::ifstream log(robot_.runtime_directory() + "/link.log");
    throw BenchError(std::string(error.what()) + " at " + name_ + ", but " + std::to_string(now) +
                     ": " + std::string(std::istreambuf_iterator<char>(log), {}));
  }
}

int LinkedHost::imported() const {
  const std::string command = "XDG_RUNTIME_DIR=" + robot_.runtime_directory() + " " +
                              program_directory() + "/arbiter status --json --instance " +
                              Robot::kInstance + " 2>/dev/null";
  const std::unique_ptr<FILE, int (*)(FILE*)> pipe(::popen(command.c_str(), "re"), ::pclose);
  if (pipe == nullptr) throw BenchError("arbiter status cannot be started");
  std::string text;
  std::array<char, 65536> some{};
  while (const std::size_t got = std::fread(some.data(), 1, some.size(), pipe.get())) {
    text.append(some.data(), got);
  }
  const auto status = nlohmann::json::parse(text, nullptr, false);
  if (!status.contains("sources")) return 0;
  int count = 0;
  for (const auto& source : status["sources"]) {
    if (!source.value("described", "").empty()) ++count;  // only links describe theirs here
  }
  return count;
}

}  // namespace arbiter::bench
