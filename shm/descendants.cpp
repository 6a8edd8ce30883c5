#include "shm/descendants.hpp"

#include <pthread.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <mutex>
#include <new>
#include <system_error>

#include "shm/limits.hpp"

namespace arbiter::shm {

// Of this process. It outlives all static objects, which may hold mappings.
struct Bequests {
  static Bequests& all() {
    static auto* const instance = new Bequests;
    return *instance;
  }

  Bequests() { pthread_atfork(prepare, in_parent, in_child); }

  void add(Bequest& bequest) {
    const std::lock_guard lock(mutex);
    bequest.next_ = first;
    bequest.before_ = &first;
    if (first != nullptr) first->before_ = &bequest.next_;
    first = &bequest;
  }
  void remove(Bequest& bequest) {
    const std::lock_guard lock(mutex);
    if (bequest.before_ == nullptr) return;
    *bequest.before_ = bequest.next_;
    if (bequest.next_ != nullptr) bequest.next_->before_ = bequest.before_;
  }

  // Little is done under the lock, so a fork does not wait for long.
  static void prepare() { all().mutex.lock(); }
  static void in_parent() { all().mutex.unlock(); }
  // The addresses and descriptors may come to be the child's own: a child of the child must find
  // none of them here.
  static void in_child() {
    const int saved = errno;
    Bequests& self = all();
    while (self.first != nullptr) {
      Bequest& bequest = *self.first;
      self.first = bequest.next_;
      bequest.before_ = nullptr;
      bequest.settle();
    }
    MarkedDescriptors::close_all();
    // A kernel that is too old has not wiped it.
    if (self.mark != nullptr) *self.mark = 0;
    self.mutex.unlock();
    errno = saved;
  }

  std::mutex mutex;
  Bequest* first = nullptr;
  std::uint8_t* mark = nullptr;  // of this process, or of an ancestor
};

Bequest::Bequest(void* address, std::size_t size, Kind kind, const std::uint32_t* users)
    : address_(address), size_(size), kind_(kind), users_(users) {
  Bequests::all().add(*this);
}

Bequest::~Bequest() { Bequests::all().remove(*this); }

void Bequest::settle() const noexcept {
  if (kind_ == Kind::kPrivateZeros) {
    static_cast<void>(mmap(address_, size_, PROT_READ | PROT_WRITE,
                           MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE | MAP_FIXED_NOREPLACE, -1,
                           0));
  } else if (kind_ == Kind::kNothing || *users_ == 0) {
    munmap(address_, size_);
  }
}

void close_in_children(const FileDescriptor& descriptor) {
  static_cast<void>(Bequests::all());
  MarkedDescriptors::mark(descriptor.get());
}

ProcessMark ProcessMark::of_this_process() {
  Bequests& bequests = Bequests::all();
  const std::lock_guard lock(bequests.mutex);
  if (bequests.mark == nullptr || *bequests.mark == 0) {
    void* const page =
        mmap(nullptr, kPageSize, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (page == MAP_FAILED) {
      throw std::system_error(errno, std::generic_category(), "mapping the mark of a process");
    }
    static_cast<void>(madvise(page, kPageSize, MADV_WIPEONFORK));  // Linux 4.14
    bequests.mark = new (page) std::uint8_t(1);
  }
  return {bequests.mark, getpid()};
}

bool ProcessMark::is_surely_here() const noexcept { return is_here() && getpid() == process_; }

}  // namespace arbiter::shm
