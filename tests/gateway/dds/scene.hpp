// A gateway between programs of DDS and a daemon, all on this machine's loopback interface, in a
// domain that no other test uses meanwhile.
#pragma once

#include <fcntl.h>
#include <poll.h>
#include <unistd.h>

#include <array>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "shm/file_descriptor.hpp"
#include "tests/gateway/dds/own_domain.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/daemon.hpp"
#include "tests/support/text_files.hpp"

namespace arbiter::test {

// A program of DDS that knows nothing of Arbiter (strangers/command_line.hpp).
class Stranger {
 public:
  // `vendor`: "cyclone" or "fast". `configuration`: of Cyclone, before that of the interface.
  Stranger(const std::string& vendor, const OwnDomain& domain, std::vector<std::string> arguments,
           const std::string& configuration = "") {
    std::array<int, 2> in{};
    std::array<int, 2> out{};
    if (::pipe2(in.data(), O_CLOEXEC) != 0 || ::pipe2(out.data(), O_CLOEXEC) != 0) {
      throw std::runtime_error("pipe2");
    }
    const shm::FileDescriptor child_in(in[0]);
    const shm::FileDescriptor child_out(out[1]);
    in_.reset(in[1]);
    out_.reset(out[0]);
    arguments.insert(arguments.begin(), std::string(ARBITER_STRANGERS) + "/stranger_" + vendor);
    arguments.push_back("domain=" + std::to_string(domain.number()));
    process_ = ChildProcess(arguments, {{"CYCLONEDDS_URI", configuration + kLoopback}},
                            {child_in.get(), child_out.get(), -1});
  }

  // To a publisher: publish that.
  void publish(const std::string& numbers) const {
    const std::string line = numbers + "\n";
    if (::write(in_.get(), line.data(), line.size()) != static_cast<ssize_t>(line.size())) {
      throw std::runtime_error("the stranger does not listen");
    }
  }
  // The next line that it writes.
  std::string next_line() {
    for (;;) {
      const auto end = text_.find('\n');
      if (end != std::string::npos) {
        const std::string line = text_.substr(0, end);
        text_.erase(0, end + 1);
        return line;
      }
      std::array<char, 4096> buffer{};
      const ssize_t count = ::read(out_.get(), buffer.data(), buffer.size());
      if (count <= 0) throw std::runtime_error("the stranger has ended");
      text_.append(buffer.data(), static_cast<std::size_t>(count));
    }
  }
  // What it has written until now, and does not need to be awaited.
  std::vector<std::string> lines_so_far() {
    std::vector<std::string> lines;
    while (auto line = line_within(0)) lines.push_back(*line);
    return lines;
  }
  // Returns once it has written that line; what came before it is dropped.
  void await(const std::string& line) {
    while (next_line() != line) {
    }
  }
  // The next line within that time; empty: there is none.
  std::optional<std::string> line_within(int milliseconds) {
    pollfd readable{out_.get(), POLLIN, 0};
    if (text_.find('\n') == std::string::npos && ::poll(&readable, 1, milliseconds) != 1) return {};
    return next_line();
  }
  // It ends as a program does that has done what it wanted.
  int end() {
    in_.reset();
    return process_.wait();
  }
  ChildProcess& process() { return process_; }

 private:
  shm::FileDescriptor in_;
  shm::FileDescriptor out_;
  std::string text_;
  ChildProcess process_;
};

// arbiter-gateway-dds for a daemon.
class DdsGateway {
 public:
  // `entries`: the elements of the mapping's <gateway>.
  DdsGateway(const Daemon& daemon, const OwnDomain& domain, const std::string& entries,
             const std::string& interface = "lo", const std::string& more = "",
             std::vector<std::string> by = {})
      : domain_(domain.number()),
        mapping_(daemon.directory() + "/gateway.xml"),
        log_(daemon.directory() + "/gateway.log"),
        by_(std::move(by)) {
    write_mapping(entries, interface, more);
    start();
  }
  void write_mapping(const std::string& entries, const std::string& interface = "lo",
                     const std::string& more = "") const {
    std::ofstream(mapping_) << "<gateway kind=\"dds\" domain=\"" << domain_ << "\" interface=\""
                            << interface << "\" " << more << ">\n"
                            << entries << "</gateway>\n";
  }
  void start() { process_ = program({"--copy", copy(), mapping_}); }
  // For one that has died: its exit code.
  int send_idle() { return program({"--send-idle", "--copy", copy(), mapping_}).wait(); }
  // Of the mapping that it has taken up.
  [[nodiscard]] std::string copy() const { return mapping_ + ".copy"; }
  // Returns once it has said so.
  void see(const std::string& text) const {
    pollfd ended{process_.descriptor(), POLLIN, 0};
    while (log().find(text) == std::string::npos) {
      if (::poll(&ended, 1, 1) != 1 || log().find(text) != std::string::npos) continue;
      throw std::runtime_error("the gateway has ended: " + log());
    }
  }
  [[nodiscard]] std::string log() const { return content_of(log_); }
  ChildProcess& process() { return process_; }
  int end() {
    process_.signal(SIGTERM);
    return process_.wait();
  }

 private:
  [[nodiscard]] ChildProcess program(std::vector<std::string> arguments) const {
    const shm::FileDescriptor log(
        ::open(log_.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600));
    // By a descriptor: whoever it runs as may not be let into this directory.
    const std::string path = std::string(ARBITER_PROGRAMS) + "/arbiter-gateway-dds";
    const shm::FileDescriptor executable(::open(path.c_str(), O_RDONLY));
    arguments.insert(arguments.begin(),
                     by_.empty() ? path : "/proc/self/fd/" + std::to_string(executable.get()));
    arguments.insert(arguments.begin(), by_.begin(), by_.end());
    return {arguments,
            {{"CYCLONEDDS_URI", std::nullopt}, {"ROS_DOMAIN_ID", std::nullopt}},
            {-1, -1, log.get()}};
  }

  const unsigned domain_;
  const std::string mapping_;
  const std::string log_;
  const std::vector<std::string> by_;  // a program that is given the command line to execute
  ChildProcess process_;
};

// Publishes that until it has come through. A volatile reader of DDS begins where it has learnt of
// its writer: Cyclone drops what Fast DDS has sent by halves when its first heartbeat comes.
inline void publish_until_heard(const Stranger& from, Stranger& to, const std::string& numbers) {
  const std::string wanted = "sample " + numbers;
  for (std::optional<std::string> line; line != wanted;) {
    if (!line) from.publish(numbers);
    line = to.line_within(50);
  }
  while (to.line_within(50) == wanted) {  // those that were still on their way
  }
}

// Whether the status says that of what stands behind the port.
inline bool is_described(Daemon& daemon, const std::string& port, const std::string& text) {
  for (const auto& end : {daemon.source(port), daemon.input(port)}) {
    if (end.is_null() || !end.contains("described") || end["described"].is_null()) continue;
    if (end["described"].get<std::string>().find(text) != std::string::npos) return true;
  }
  return false;
}
inline void await_described(Daemon& daemon, const std::string& port, const std::string& text) {
  while (!is_described(daemon, port, text)) ::poll(nullptr, 0, 1);
}

// Navigation, and teleoperation that overrides it.
inline const std::string kBaseModel = R"(<behaviors timeout="TIMEOUT">
  <behavior name="Navigate"><config at="/Base/cmd_vel:i">/Nav/cmd_vel:o</config></behavior>
  <behavior name="Teleoperate"><config at="/Base/cmd_vel:i">/Teleop/cmd_vel:o</config>
    <inhibition>Navigate</inhibition></behavior>
</behaviors>
)";
inline std::string base_model(const std::string& timeout) {
  std::string result = kBaseModel;
  return result.replace(result.find("TIMEOUT"), 7, timeout);
}

inline const std::string kTwist = R"(type="geometry_msgs/msg/Twist")";
inline const std::string kNavIn =
    R"(<in topic="/cmd_vel_nav" )" + kTwist + R"( port="/Nav/cmd_vel:o"/>)";
inline const std::string kTeleopIn =
    R"(<in topic="/cmd_vel_teleop" )" + kTwist + R"( port="/Teleop/cmd_vel:o"/>)";
inline const std::string kBaseOut = R"(<out port="/Base/cmd_vel:i" topic="/cmd_vel" )" + kTwist;

// A stranger whose samples pass a gateway to another, once they all have found each other.
struct Passage {
  // `entries` has one topic in, and one out.
  Passage(const std::string& model, const std::string& entries, const std::string& in_vendor,
          const std::vector<std::string>& in_topic, const std::string& out_vendor,
          const std::vector<std::string>& out_topic)
      : daemon(model),
        gateway(daemon, domain, entries),
        to(out_vendor, domain, with("sub", out_topic)),
        from(in_vendor, domain, with("pub", in_topic)) {
    to.await("matched 1");
    from.await("matched 1");
    gateway.see("1 publisher matched");
    // A writer sends to those that it has found, which may be later than they have found it.
    gateway.see("1 subscriber matched");
  }

  OwnDomain domain;
  Daemon daemon;
  DdsGateway gateway;
  Stranger to;
  Stranger from;

 private:
  static std::vector<std::string> with(const std::string& role, std::vector<std::string> topic) {
    topic.insert(topic.begin(), role);
    return topic;
  }
};

// Navigation drives a base, which is told to stop while nobody does.
struct Drive : Passage {
  Drive(const std::string& timeout, const std::string& in_vendor, const std::string& out_vendor,
        const std::string& idle = R"( idle="zero")")
      : Passage(base_model(timeout), kNavIn + kBaseOut + idle + "/>", in_vendor,
                {"twist", "rt/cmd_vel_nav"}, out_vendor, {"twist", "rt/cmd_vel"}) {}
};

}  // namespace arbiter::test
