// A conversation with the daemon for one question: to this very daemon, and for as long as it
// takes. A node would ask the next daemon again where this one goes, which is no good for what must
// happen once. Whatever takes long is told on standard error.
#pragma once

#include <cstdint>
#include <string>

#include <nlohmann/json_fwd.hpp>

#include "shm/file_descriptor.hpp"
#include "wire/messages.hpp"

namespace arbiter::cli {

class Conversation {
 public:
  // Says hello as "arbiter-VERB". Throws arbiter::Error where there is no daemon, or one that does
  // not answer: then nothing was asked of it.
  Conversation(const std::string& verb, const std::string& instance);

  // Throws arbiter::Error where it refuses, or goes.
  shm::Received ask(shm::Message question);
  // The report on a change of the model, be it refused. Writes the report to standard output
  // (`json`), or what was found in files, and why the change is refused, to standard error.
  nlohmann::json ask_for_change(shm::Message question, bool json);

  // The daemon's process as a descriptor, none where it cannot be seen from here.
  [[nodiscard]] shm::FileDescriptor process() const;
  // Returns when it has hung up, and that process is gone.
  void wait_until_gone(const shm::FileDescriptor& process);

 private:
  // Until it is readable. False: not within the limit (-1: there is none).
  bool wait_for(int descriptor, int limit_ms, const std::string& what);
  shm::Received receive_answer(const shm::Message& question, int limit_ms);

  const std::string instance_;
  shm::FileDescriptor socket_;
  bool has_told_ = false;  // that it waits
  std::uint64_t last_request_ = 0;
};

// "model 5 is in force", and what that changes.
void write_in_force(const nlohmann::json& report);
// That, unless `json`; gives the verb's exit code.
int write_result(const nlohmann::json& report, bool json);

}  // namespace arbiter::cli
