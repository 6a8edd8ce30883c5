// What the verbs that talk to a running daemon have in common.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include <arbiter/arbiter.hpp>
#include <nlohmann/json_fwd.hpp>

#include "client/node_core.hpp"
#include "shm/file_descriptor.hpp"

namespace CLI {
class App;
}

namespace arbiter::cli {

// --instance.
void add_instance_option(CLI::App& verb, std::string& instance);

// How long a verb looks for a daemon before it says that there is none.
inline constexpr std::chrono::milliseconds kConnectTimeout{300};

// Notices go to standard error.
NodeOptions live_options(const std::string& instance);

// Connects to the daemon. Throws arbiter::Error.
std::shared_ptr<detail::NodeCore> connect(const std::string& verb, const std::string& instance);

// A document that the daemon answers such a question with. Throws arbiter::Error.
nlohmann::json fetch_document(detail::NodeCore& node, shm::MessageKind kind);
// The daemon's status document. Throws arbiter::Error.
nlohmann::json fetch_status(detail::NodeCore& node);

// A document that the daemon has sent. Throws arbiter::Error.
nlohmann::json read_document(const shm::FileDescriptor& descriptor);

// SIGINT and SIGTERM as a descriptor, so that a stream ends with its summary. Call before threads
// start.
shm::FileDescriptor catch_interrupts();

// Sleeps until `time` on CLOCK_MONOTONIC, or until `interrupts` is readable; true: it is.
bool sleep_until(shm::Nanoseconds time, const shm::FileDescriptor& interrupts);

// Whether a process lives, and does not run: it was sent SIGSTOP, or is being debugged.
bool is_stopped(int pid);

// 1 500 000 000 -> "1.500 s".
std::string seconds_text(shm::Nanoseconds span);

}  // namespace arbiter::cli
