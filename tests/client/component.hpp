// A component in a process of its own (component_main.cpp), as a test speaks to it.
#pragma once

#include <fcntl.h>
#include <unistd.h>

#include <stdexcept>
#include <string>
#include <vector>

#include "tests/support/child_process.hpp"
#include "tests/support/hear_all.hpp"

namespace arbiter::test {

class Component {
 public:
  // Starts the process and makes its node. `by`: a program that is given the command line to
  // execute.
  explicit Component(const std::string& node, std::vector<std::string> by = {}) {
    int in[2];
    int out[2];
    if (::pipe2(in, O_CLOEXEC) != 0 || ::pipe2(out, O_CLOEXEC) != 0) {
      throw std::runtime_error("pipe2");
    }
    const shm::FileDescriptor child_in(in[0]);
    const shm::FileDescriptor child_out(out[1]);
    say_.reset(in[1]);
    hear_.reset(out[0]);
    by.push_back(ARBITER_COMPONENT);
    process_ = ChildProcess(by, {}, {child_in.get(), child_out.get(), -1});
    if (const auto answer = tell("node " + node); answer != "done") {
      throw std::runtime_error(answer);
    }
  }

  // Does one thing, and answers how it went.
  std::string tell(const std::string& line) {
    begin(line);
    return answer();
  }
  // The two halves of tell().
  void begin(const std::string& line) const {
    const std::string whole = line + "\n";
    if (::write(say_.get(), whole.data(), whole.size()) != static_cast<ssize_t>(whole.size())) {
      throw std::runtime_error("the component does not listen");
    }
  }
  // "dead" if it has ended.
  std::string answer() {
    for (;;) {
      if (const auto end = heard_.find('\n'); end != std::string::npos) {
        const std::string line = heard_.substr(0, end);
        heard_.erase(0, end + 1);
        return line;
      }
      char buffer[512];
      const ssize_t size = ::read(hear_.get(), buffer, sizeof buffer);
      if (size <= 0) return "dead";
      heard_.append(buffer, static_cast<std::size_t>(size));
    }
  }

  // Readable once there is an answer.
  [[nodiscard]] int descriptor() const { return hear_.get(); }

  [[nodiscard]] ChildProcess& process() { return process_; }
  // At whatever instruction it is.
  void kill() { process_.kill(); }
  // In order: it closes its ports, and its node. Returns as ChildProcess::wait().
  int end() {
    say_.reset();
    return process_.wait();
  }

 private:
  shm::FileDescriptor say_;
  shm::FileDescriptor hear_;
  std::string heard_;
  ChildProcess process_;
};

// As hear_all(Node&).
inline void hear_all(Component& component) {
  const std::string name = name_of_nobody();
  for (const std::string verb : {"output ", "close "}) {
    const std::string answer = component.tell(verb + name);
    if (answer != "open" && answer != "closed") throw std::runtime_error(answer);
  }
}

}  // namespace arbiter::test
