// arbiter echo: watching a port, or opening it.
//
//   verb_echo.cpp       its options
//   echo_loop.cpp       when it looks, and until when
//   echo_tap.cpp        prints what a tap tells
//   echo_hosts.cpp      from which hosts arrivals come
//   echo_news.cpp       what becomes of the daemon and of the model
//   echo_rate.cpp       prints how often, how regularly and how much
//   echo_component.cpp  opens an input port itself, and prints what it takes
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include <arbiter/arbiter.hpp>

#include "cli/echo_news.hpp"
#include "shm/activity.hpp"
#include "shm/file_descriptor.hpp"

namespace arbiter::cli {

struct EchoOptions {
  std::string port;
  std::string instance;
  std::uint64_t count = 0;  // 0: no limit
  shm::Nanoseconds duration = shm::kForever;
  bool json = false;
  bool losers = false;
  bool hex = false;
  bool rate = false;
  bool as_component = false;
};

// Each returns the exit code when the time is over, enough has been printed, or `interrupts` is
// readable. Throw Error.
int echo_tap(const EchoOptions& options, const shm::FileDescriptor& interrupts);
int echo_rate(const EchoOptions& options, const shm::FileDescriptor& interrupts);
int echo_component(const EchoOptions& options, const shm::FileDescriptor& interrupts);

shm::Nanoseconds end_of_echo(const EchoOptions& options, shm::Nanoseconds started);
// Of the node that opens what echo watches. The daemon has answered just before: it is there.
NodeOptions echo_node_options(const EchoOptions& options);
// What a look has left. With kMore nobody rings for it.
enum class Looked : std::uint8_t { kNothing, kMore, kEnough };
// In one look: a port that is never silent must not keep echo from hearing Ctrl-C.
inline constexpr int kMostOfLook = 1024;
// Calls look() when fd() is readable, and ten times a second, until that says kEnough, the time is
// over, or `interrupts` is readable.
void echo_while(const EchoOptions& options, const std::function<int()>& fd,
                const shm::FileDescriptor& interrupts, EchoNews& news,
                const std::function<Looked()>& look);

// Whether PORT is an output port or an input port, as far as the daemon knows; else by the end of
// its name. Says on standard error if nobody has named it, or has it open. `instance`: null where
// it cannot be observed.
TapOf kind_of_port(const EchoOptions& options, watch::Instance* instance);

// "01 02 … ", all bytes or the first few.
std::string hex_of(const Bytes& bytes, std::size_t most);
std::string preview(const Bytes& bytes);
// A line for each 16 bytes, with its offset.
std::string hex_dump(const Bytes& bytes);

}  // namespace arbiter::cli
