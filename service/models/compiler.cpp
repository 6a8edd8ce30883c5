#include "service/models/compiler.hpp"

#include <sys/eventfd.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <system_error>
#include <utility>

#include "service/log/log.hpp"

namespace arbiter::service {
namespace {

// A job looks at its stop token every few milliseconds while it proves; reading and extracting the
// largest model takes about a second.
constexpr std::chrono::seconds kMaxWaitForJob{5};

}  // namespace

// How a job ended.
struct Compiler::Ended {
  std::mutex mutex;
  std::condition_variable changed;
  bool is_over = false;  // all under the mutex
  Reading reading;
  std::exception_ptr error;

  void run(const Job& job, const std::stop_token& stop) noexcept {
    Reading made;
    std::exception_ptr thrown;
    try {
      made = job(stop);
    } catch (...) {
      thrown = std::current_exception();
    }
    const std::lock_guard lock(mutex);
    reading = std::move(made);
    error = std::move(thrown);
    is_over = true;
    changed.notify_all();
  }
};

Compiler::Compiler(Thread thread)
    : kind_(thread),
      ready_(std::make_shared<const shm::FileDescriptor>(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK))) {
  if (!*ready_) throw std::system_error(errno, std::generic_category(), "eventfd");
}

Compiler::~Compiler() {
  if (!thread_.joinable()) return;
  stop();
  std::unique_lock lock(ended_->mutex);
  const bool is_over =
      ended_->changed.wait_for(lock, kMaxWaitForJob, [&] { return ended_->is_over; });
  lock.unlock();
  if (is_over) {
    thread_.join();
    return;
  }
  log::warn("a file that is read does not let itself be read, nor left: it is left all the same");
  left_behind = true;
  thread_.detach();
}

void Compiler::start(Job job) {
  stop_ = std::stop_source();
  auto ended = std::make_shared<Ended>();
  const auto run = [ended, ready = ready_, job = std::move(job), stop = stop_.get_token()] {
    ended->run(job, stop);
    const std::uint64_t one = 1;
    // Cannot fail: the counter is 0, since there is one job at a time.
    static_cast<void>(!::write(ready->get(), &one, sizeof one));
  };
  if (kind_ == Thread::kOfCaller) {
    run();
  } else {
    thread_ = std::thread(run);
  }
  ended_ = std::move(ended);
}

Reading Compiler::take() {
  if (thread_.joinable()) thread_.join();
  std::uint64_t count = 0;
  static_cast<void>(!::read(ready_->get(), &count, sizeof count));
  const std::shared_ptr<Ended> ended = std::exchange(ended_, nullptr);
  if (ended->error) std::rethrow_exception(ended->error);
  return std::move(ended->reading);
}

}  // namespace arbiter::service
