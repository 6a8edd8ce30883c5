#include "tests/realtime/data_path_thread.hpp"

#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <poll.h>
#include <pthread.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <fstream>
#include <semaphore>
#include <sstream>
#include <stdexcept>
#include <string>
#include <thread>

#include "shm/file_descriptor.hpp"
#include "tests/realtime/allocations.hpp"

namespace arbiter::test {
namespace {

// Every system call of the calling thread is told to whoever reads the descriptor; -1: not
// possible.
int tell_of_system_calls() {
  sock_filter every_call[] = {BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_USER_NOTIF)};
  const sock_fprog program{1, every_call};
  if (::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0) return -1;
  return static_cast<int>(
      ::syscall(SYS_seccomp, SECCOMP_SET_MODE_FILTER, SECCOMP_FILTER_FLAG_NEW_LISTENER, &program));
}

long page_faults() {
  rusage usage{};
  ::getrusage(RUSAGE_THREAD, &usage);
  return usage.ru_minflt + usage.ru_majflt;
}

// Deeper than any call goes.
__attribute__((noinline)) void touch_stack() {
  char depth[256 * 1024];
  std::memset(depth, 1, sizeof depth);
  asm volatile("" : : "r"(depth) : "memory");
}

// What mlockall(MCL_CURRENT) would do for what is mapped of the program's files, without its
// privilege. Shared memory is left alone, and so is the heap: they are what is tested.
void touch_program() {
  std::ifstream maps("/proc/self/maps");
  for (std::string line; std::getline(maps, line);) {
    std::istringstream fields(line);
    std::uintptr_t begin = 0;
    std::uintptr_t end = 0;
    char dash = 0;
    std::string access;
    std::string offset;
    std::string device;
    ino_t inode = 0;
    fields >> std::hex >> begin >> dash >> end >> access >> offset >> device >> std::dec >> inode;
    if (inode == 0 || access[0] != 'r' || access[3] != 'p') continue;
    const int how = access[1] == 'w' ? MADV_POPULATE_WRITE : MADV_POPULATE_READ;
    static_cast<void>(::madvise(reinterpret_cast<void*>(begin), end - begin, how));
  }
}

}  // namespace

class DataPathThread::State {
 public:
  State() : thread_([this] { live(); }) {
    // Not by a system call: that would wait for the watcher.
    while (listener_ == kNotYet) std::this_thread::yield();
    if (listener_ < 0) {
      thread_.join();
      throw std::runtime_error("seccomp tells of no system calls here: " +
                               std::string(std::strerror(error_)));
    }
    calls_.reset(listener_);
    watcher_ = std::thread([this] { watch(); });
  }
  ~State() {
    order({});
    thread_.join();
    watcher_.join();
  }

  void order(std::function<void()> work) {
    work_ = std::move(work);
    touch_program();
    ordered_.release();
  }
  Costs await() {
    done_.acquire();
    return std::move(costs_);
  }
  [[nodiscard]] int task() const { return task_; }

 private:
  void live() {
    task_ = static_cast<int>(::syscall(SYS_gettid));
    const int listener = tell_of_system_calls();
    error_ = errno;
    listener_ = listener;
    if (listener < 0) return;
    for (;;) {
      ordered_.acquire();
      if (!work_) return;
      touch_stack();
      costs_ = {};
      costs_.system_calls.reserve(kMaxCalls);
      const long faults_before = page_faults();
      const std::uint64_t allocations_before = allocations_of_this_thread();
      records_.store(true);
      work_();
      records_.store(false);
      costs_.allocations = allocations_of_this_thread() - allocations_before;
      costs_.page_faults = page_faults() - faults_before;
      done_.release();
    }
  }

  // The thread stands still from its call until it is told to go on, so `records_` is what it was
  // at the call.
  void watch() {
    for (;;) {
      pollfd call{calls_.get(), POLLIN, 0};
      if (::poll(&call, 1, -1) < 0) continue;
      if ((call.revents & POLLIN) == 0) return;  // the thread has ended
      seccomp_notif notification{};
      if (::ioctl(calls_.get(), SECCOMP_IOCTL_NOTIF_RECV, &notification) != 0) continue;
      if (records_.load() && costs_.system_calls.size() < kMaxCalls) {
        costs_.system_calls.push_back(notification.data.nr);
      }
      seccomp_notif_resp response{};
      response.id = notification.id;
      response.flags = SECCOMP_USER_NOTIF_FLAG_CONTINUE;
      ::ioctl(calls_.get(), SECCOMP_IOCTL_NOTIF_SEND, &response);
    }
  }

  static constexpr std::size_t kMaxCalls = 1000;
  static constexpr int kNotYet = -2;

  std::function<void()> work_;
  Costs costs_;
  std::atomic<bool> records_{false};
  std::atomic<int> task_{0};
  int error_ = 0;  // before listener_
  std::atomic<int> listener_{kNotYet};
  shm::FileDescriptor calls_;
  std::binary_semaphore ordered_{0};
  std::binary_semaphore done_{0};
  std::thread watcher_;
  std::thread thread_;  // last: it uses all of the above
};

DataPathThread::DataPathThread() : state_(std::make_unique<State>()) {}
DataPathThread::~DataPathThread() = default;

void DataPathThread::begin(std::function<void()> work) { state_->order(std::move(work)); }
Costs DataPathThread::end() { return state_->await(); }
Costs DataPathThread::costs_of(std::function<void()> work) {
  begin(std::move(work));
  return end();
}
void DataPathThread::run(std::function<void()> work) { costs_of(std::move(work)); }
int DataPathThread::task() const { return state_->task(); }

std::ostream& operator<<(std::ostream& out, const Costs& costs) {
  out << costs.page_faults << " page faults, " << costs.allocations
      << " allocations, system calls:";
  for (const int call : costs.system_calls) out << ' ' << call;
  return out;
}

}  // namespace arbiter::test
