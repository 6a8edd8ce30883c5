// A process of the benchmark's own that does what it is told.
//
// The benchmark itself has one thread and knows no middleware; all that is measured runs in
// workers, so that no two systems share a process, and a system that hangs or dies takes nothing
// with it.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <functional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "bench/harness/histogram.hpp"
#include "shm/file_descriptor.hpp"

namespace arbiter::bench {

struct BenchError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// One end of a conversation: words and text, in order. Blocks. Throws BenchError where the other
// has ended, has nothing to say for two minutes, or says something else than is expected.
class Conversation {
 public:
  explicit Conversation(shm::FileDescriptor socket) : socket_(std::move(socket)) {}

  void say(std::uint64_t word) { say(std::vector<std::uint64_t>{word}); }
  void say(const std::vector<std::uint64_t>& words);
  void say(const Histogram& histogram) { say(histogram.words()); }
  void fail(std::string_view why);
  void end();

  std::uint64_t hear() { return hear_words().at(0); }
  std::vector<std::uint64_t> hear_words();
  Histogram hear_histogram() { return Histogram::of(hear_words()); }
  // False: the other has ended the conversation.
  bool hear_or_end(std::uint64_t& word);
  // Readable when there is something to hear, or the other has ended it.
  [[nodiscard]] int descriptor() const { return socket_.get(); }

 private:
  void send(std::uint64_t kind, const void* data, std::size_t size);
  bool receive(std::vector<std::uint64_t>& words);

  shm::FileDescriptor socket_;
};

class Worker {
 public:
  using Work = std::function<void(Conversation& with)>;

  Worker() = default;
  // Runs `work` in a new process, which ends with it, and with this one.
  Worker(std::string name, const Work& work);
  Worker(Worker&&) noexcept;
  Worker& operator=(Worker&&) noexcept;
  ~Worker();

  // Throws BenchError, with the worker's name, also where it has failed.
  void say(std::uint64_t word);
  std::uint64_t hear();
  std::vector<std::uint64_t> hear_words();
  Histogram hear_histogram();
  [[nodiscard]] pid_t pid() const { return pid_; }

 private:
  template <class Call>
  auto named(Call call);
  void end() noexcept;

  std::string name_;
  pid_t pid_ = -1;
  Conversation conversation_{shm::FileDescriptor()};
};

}  // namespace arbiter::bench
