// Reads, proves, compiles and compares models in a thread of its own, while the daemon's loop
// serves others: a model may take most of a minute.
//
// A job knows what it was given when it began: values, and models that nobody changes. What it
// makes of them nobody else sees before it is finished. Then the descriptor is readable, and the
// loop, which alone touches the daemon's state, takes it. There is one job at a time: decision
// diagrams exist once in a process.
//
// Thread safety: all members are for one thread, the loop's. It shares with the job's thread what
// stands under the mutex of Compiler::Ended, and a stop token.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "service/clients/gate.hpp"
#include "service/log/findings.hpp"
#include "service/models/arguments.hpp"
#include "service/models/library.hpp"
#include "shm/file_descriptor.hpp"

namespace arbiter::service {

// What the files say now, and what that changes.
struct Reading {
  Findings findings;  // the rest is to be used only if there is no error
  std::optional<Policy> policy;
  std::vector<ModelPointer> models;
  // What it changes, as changes_json() has it, in bytes; "null": not known, or not asked for.
  std::string changes = "null";    // of the model in force
  std::vector<std::string> diffs;  // of each model, where that was asked for
};

class Compiler {
 public:
  using Job = std::function<Reading(std::stop_token)>;
  enum class Thread {
    kOfItsOwn,
    kOfCaller,  // start() returns when the job is over: for who must do the same each time
  };

  // Throws std::system_error.
  explicit Compiler(Thread thread = Thread::kOfItsOwn);
  Compiler(const Compiler&) = delete;
  Compiler& operator=(const Compiler&) = delete;
  // Asks a job that runs to stop, and waits for it, but not for ever: see has_left_a_thread().
  ~Compiler();

  // Readable from when a job has ended until take().
  [[nodiscard]] int descriptor() const { return ready_->get(); }
  [[nodiscard]] bool is_busy() const { return ended_ != nullptr; }
  // While it is not busy. Throws std::system_error where there can be no thread.
  void start(Job job);
  // Asks the job to stop; it ends soon, by rules::Stopped.
  void stop() { stop_.request_stop(); }
  // Once the descriptor is readable: what the job has made. Throws what it has thrown.
  [[nodiscard]] Reading take();

  // Some job did not let itself be stopped, since a file held it up. Its thread still runs, and the
  // process must end without the destructors of what is static.
  [[nodiscard]] static bool has_left_a_thread() { return left_behind; }

 private:
  struct Ended;

  const Thread kind_;
  std::shared_ptr<const shm::FileDescriptor> ready_;  // of the job too, which may outlive this
  std::shared_ptr<Ended> ended_;                      // of the job at hand
  std::stop_source stop_;
  std::thread thread_;
  static inline bool left_behind = false;  // a thread; of the loop's thread only
};

}  // namespace arbiter::service
