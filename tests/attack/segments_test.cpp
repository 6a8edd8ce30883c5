// One writer, enforced: what a component can do to memory that is another's. Nothing, if it runs as
// another user; between processes of one user a stray store faults, and a component's own segments
// are safe even from an attack.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/ptrace.h>
#include <sys/stat.h>
#include <sys/uio.h>

#include <atomic>
#include <cstring>
#include <functional>
#include <string>
#include <vector>

#include "tests/attack/attacker.hpp"
#include "tests/attack/prey.hpp"
#include "tests/support/other_user.hpp"

namespace {

using arbiter::shm::FileDescriptor;
using arbiter::test::As;
using arbiter::test::Attacked;
using arbiter::test::may_be_another_user;
using arbiter::test::Prey;
using arbiter::test::run_attack;

std::size_t size_of(int fd) {
  struct stat status {};
  ::fstat(fd, &status);
  return static_cast<std::size_t>(status.st_size);
}

struct Mapped {
  Mapped(int fd, int protection)
      : size(size_of(fd)), data(::mmap(nullptr, size, protection, MAP_SHARED, fd, 0)) {}
  [[nodiscard]] bool exists() const { return data != MAP_FAILED; }
  std::size_t size;
  void* data;
};

// Each thing that can be tried with a descriptor; the names of those that succeed.
std::string attack_descriptor(int fd) {
  std::string succeeded;
  const auto attempt = [&](const char* name, bool success) {
    if (success) succeeded += std::string(name) + "; ";
  };
  const auto size = static_cast<off_t>(size_of(fd));
  const char garbage[] = "garbage";
  attempt("write", ::write(fd, garbage, sizeof garbage) > 0);
  attempt("pwrite", ::pwrite(fd, garbage, sizeof garbage, 64) > 0);
  attempt("grow", ::ftruncate(fd, size + 4096) == 0);
  attempt("shrink", ::ftruncate(fd, 0) == 0);
  attempt("allocate more", ::fallocate(fd, 0, size, 4096) == 0);
  attempt("punch a hole",
          ::fallocate(fd, FALLOC_FL_PUNCH_HOLE | FALLOC_FL_KEEP_SIZE, 0, 4096) == 0);
  attempt("zero a range",
          ::fallocate(fd, FALLOC_FL_ZERO_RANGE | FALLOC_FL_KEEP_SIZE, 0, 4096) == 0);
  attempt("add a seal", ::fcntl(fd, F_ADD_SEALS, F_SEAL_WRITE) == 0);
  attempt("change the mode", ::fchmod(fd, 0666) == 0);
  attempt("map writable", Mapped(fd, PROT_READ | PROT_WRITE).exists());
  const Mapped readable(fd, PROT_READ);
  attempt("make a mapping writable",
          ::mprotect(readable.data, readable.size, PROT_READ | PROT_WRITE) == 0);
  attempt("make a mapping executable and writable",
          ::mprotect(readable.data, readable.size, PROT_READ | PROT_WRITE | PROT_EXEC) == 0);
  attempt("remove pages", ::madvise(readable.data, readable.size, MADV_REMOVE) == 0);
  return succeeded;
}

std::string reopened(int fd, int flags, const std::function<std::string(int)>& then) {
  const FileDescriptor again(::open(("/proc/self/fd/" + std::to_string(fd)).c_str(), flags));
  return again ? then(again.get()) : "";
}

std::string attack_and_reopen(int fd) {
  const auto opened = [](int) { return std::string("reopen; "); };
  return attack_descriptor(fd) + reopened(fd, O_RDWR, opened) + reopened(fd, O_WRONLY, opened) +
         reopened(fd, O_RDWR | O_TRUNC, opened);
}

struct Named {
  const char* name;
  FileDescriptor Prey::*descriptor;
};
constexpr Named kAll[]{{"board", &Prey::board},
                       {"registry", &Prey::registry},
                       {"activity page", &Prey::page},
                       {"output segment", &Prey::output},
                       {"input segment", &Prey::input}};
constexpr Named kOfComponents[]{{"output segment", &Prey::output}, {"input segment", &Prey::input}};
constexpr Named kOfTheDaemon[]{
    {"board", &Prey::board}, {"registry", &Prey::registry}, {"activity page", &Prey::page}};

TEST(ForeignMemory, FaultsWhenItIsStoredTo) {
  Prey prey;
  for (const Named& each : kAll) {
    const int fd = (prey.*each.descriptor).get();
    const Attacked stored = run_attack(As::kSameUser, [&] {
      const Mapped mapped(fd, PROT_READ);
      *static_cast<std::atomic<char>*>(mapped.data) = 1;
      return "stored";
    });
    EXPECT_EQ(stored.signal, SIGSEGV) << each.name << ' ' << stored.said;
  }
}

TEST(ForeignMemory, CannotBeChangedThroughTheDescriptorThatOneIsGiven) {
  Prey prey;
  for (const Named& each : kAll) {
    const int fd = (prey.*each.descriptor).get();
    std::string succeeded = run_attack(As::kSameUser, [&] { return attack_descriptor(fd); }).said;
    // To its owner, and to root, the mode is a matter of course; it opens nothing that
    // the owner cannot open anyway.
    if (const auto at = succeeded.find("change the mode; "); at != std::string::npos) {
      succeeded.erase(at, std::strlen("change the mode; "));
    }
    EXPECT_EQ(succeeded, "done ") << each.name;
  }
}

// F_SEAL_FUTURE_WRITE holds for every descriptor, however it was come by.
TEST(ForeignSegmentsOfComponents, CannotBeChangedByAProcessOfTheSameUserThatReopensThem) {
  Prey prey;
  for (const Named& each : kOfComponents) {
    const int fd = (prey.*each.descriptor).get();
    std::string succeeded =
        run_attack(As::kSameUser, [&] { return reopened(fd, O_RDWR, attack_descriptor); }).said;
    if (const auto at = succeeded.find("change the mode; "); at != std::string::npos) {
      succeeded.erase(at, std::strlen("change the mode; "));
    }
    EXPECT_EQ(succeeded, "done ") << each.name;
  }
}

// What docs/reliability.md says is possible between processes of one user.
TEST(PagesOfTheDaemon, CanBeReopenedByAProcessOfTheSameUser) {
  Prey prey;
  for (const Named& each : kOfTheDaemon) {
    const int fd = (prey.*each.descriptor).get();
    const auto map_writable = [](int again) {
      return std::string(Mapped(again, PROT_READ | PROT_WRITE).exists() ? "writable" : "");
    };
    EXPECT_EQ(run_attack(As::kSameUser, [&] { return reopened(fd, O_RDWR, map_writable); }).said,
              "done writable")
        << each.name;
    // Not even then can the others be made to fault.
    const auto shrink = [](int again) {
      return std::string(::ftruncate(again, 0) == 0 ? "shrunk" : "");
    };
    EXPECT_EQ(run_attack(As::kSameUser, [&] { return reopened(fd, O_RDWR, shrink); }).said, "done ")
        << each.name;
  }
}

class AStranger : public testing::Test {
 protected:
  void SetUp() override {
    if (!may_be_another_user()) GTEST_SKIP() << "only root can become another user";
  }
};

TEST_F(AStranger, CanChangeNoForeignMemory) {
  Prey prey;
  for (const Named& each : kAll) {
    const int fd = (prey.*each.descriptor).get();
    EXPECT_EQ(run_attack(As::kAnotherUser, [&] { return attack_and_reopen(fd); }).said, "done ")
        << each.name;
  }
}

TEST_F(AStranger, HasNoOtherWayIntoAProcess) {
  Prey prey;
  for (const pid_t process : {::getpid(), prey.daemon().process().pid()}) {
    EXPECT_EQ(
        run_attack(As::kAnotherUser,
                   [&] {
                     std::string succeeded;
                     const std::string directory = "/proc/" + std::to_string(process);
                     for (const char* file : {"/mem", "/fd/3", "/fd/4", "/fd/5", "/environ"}) {
                       const FileDescriptor opened(::open((directory + file).c_str(), O_RDONLY));
                       if (opened) succeeded += std::string(file) + "; ";
                     }
                     if (::ptrace(PTRACE_ATTACH, process, nullptr, nullptr) == 0) {
                       succeeded += "ptrace; ";
                     }
                     char byte = 0;
                     const iovec local{&byte, 1};
                     const iovec remote{&prey, 1};
                     if (::process_vm_writev(process, &local, 1, &remote, 1, 0) > 0) {
                       succeeded += "process_vm_writev; ";
                     }
                     if (::kill(process, 0) == 0) succeeded += "signal; ";
                     return succeeded;
                   })
            .said,
        "done ")
        << process;
  }
}

}  // namespace
