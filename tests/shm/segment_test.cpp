// What the kernel must do for us.
#include "shm/segment.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstddef>
#include <string>

#include "shm/bell.hpp"
#include "tests/support/error_of.hpp"

namespace arbiter::shm {
namespace {

constexpr std::size_t kSize = 2 * 4096;

void* map(int fd, int protection) { return mmap(nullptr, kSize, protection, MAP_SHARED, fd, 0); }

class SealedSegment : public testing::Test {
 protected:
  SealedSegment() : segment_(make_segment("arbiter-test", kSize)) {
    mapping_ = Mapping(segment_, kSize, Access::kReadWrite);
    mapping_.data()[0] = std::byte{1};
    seal(segment_, Seals::kOneWriter);
  }

  FileDescriptor segment_;
  Mapping mapping_;
};

TEST_F(SealedSegment, ItsOwnerWritesOnThroughTheMappingItHas) {
  mapping_.data()[0] = std::byte{42};
  const Mapping reader(reopen(segment_, O_RDONLY), kSize, Access::kReadOnly);
  EXPECT_EQ(reader.data()[0], std::byte{42});
}

TEST_F(SealedSegment, CannotBeMappedWritableAgainNotEvenByItsOwner) {
  EXPECT_EQ(map(segment_.get(), PROT_READ | PROT_WRITE), MAP_FAILED);
  EXPECT_THROW(Mapping(segment_, kSize, Access::kReadWrite), std::system_error);
}

TEST_F(SealedSegment, CannotBeMadeWritableAfterItWasMappedToBeRead) {
  void* const read_only = map(segment_.get(), PROT_READ);
  ASSERT_NE(read_only, MAP_FAILED);
  EXPECT_NE(mprotect(read_only, kSize, PROT_READ | PROT_WRITE), 0);
  EXPECT_EQ(errno, EACCES);
  munmap(read_only, kSize);
}

TEST_F(SealedSegment, CannotBeWrittenByASystemCall) {
  const char byte = 9;
  EXPECT_LT(pwrite(segment_.get(), &byte, 1, 0), 0);
  EXPECT_EQ(errno, EPERM);
}

TEST_F(SealedSegment, CanNeitherShrinkNorGrow) {
  EXPECT_NE(ftruncate(segment_.get(), 0), 0);
  EXPECT_NE(ftruncate(segment_.get(), 2 * kSize), 0);
  EXPECT_NE(fallocate(segment_.get(), 0, 0, 2 * kSize), 0);
  EXPECT_EQ(checked_size(segment_, Seals::kOneWriter), kSize);
}

TEST_F(SealedSegment, TakesNoFurtherSealsAndGivesNoneBack) {
  EXPECT_NE(fcntl(segment_.get(), F_ADD_SEALS, F_SEAL_WRITE), 0);
  EXPECT_EQ(errno, EPERM);
}

TEST_F(SealedSegment, OpenedAnewForWritingItStillCannotBeMappedWritable) {
  const FileDescriptor again = reopen(segment_, O_RDWR);
  EXPECT_EQ(map(again.get(), PROT_READ | PROT_WRITE), MAP_FAILED);
}

TEST_F(SealedSegment, ItsMemoryCanStillBeAllocated) {
  EXPECT_FALSE(allocate(segment_, 0, kSize));
  EXPECT_TRUE(allocate(segment_, kSize, 1)) << "but not beyond its end";
}

// The kernel would end the process.
TEST(Segment, ThatIsLargerThanAFileMayBeIsAnError) {
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
  const rlimit small{1 << 20, before.rlim_max};
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &small), 0);
  const std::string what = test::error_of([] { make_segment("test", (1 << 20) + 1); });
  EXPECT_NE(make_segment("test", 1 << 20).get(), -1);
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &before), 0);
  EXPECT_NE(what.find("a segment of 1025 KiB, which is a file: this process may write files of "
                      "1024 KiB (RLIMIT_FSIZE, ulimit -f)"),
            what.npos)
      << what;
}

TEST(Segment, OneHandedOutReadOnlyCannotBeMappedWritable) {
  const FileDescriptor page = make_segment("arbiter-test", kSize);
  seal(page, Seals::kFixedSize);
  const FileDescriptor reader = reopen(page, O_RDONLY);
  EXPECT_EQ(map(reader.get(), PROT_READ | PROT_WRITE), MAP_FAILED);
  void* const read_only = map(reader.get(), PROT_READ);
  ASSERT_NE(read_only, MAP_FAILED);
  EXPECT_NE(mprotect(read_only, kSize, PROT_READ | PROT_WRITE), 0);
  munmap(read_only, kSize);
  const Mapping successor(page, kSize, Access::kReadWrite);  // its writer may map it again
  EXPECT_EQ(successor.size(), kSize);
}

TEST(Segment, ItsModeLetsNobodyElseWrite) {
  const FileDescriptor segment = make_segment("arbiter-test", kSize);
  struct stat status {};
  ASSERT_EQ(fstat(segment.get(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777u, 0644u);
}

TEST(Segment, OfAnotherKindOrWithoutItsSealsItIsNotTaken) {
  const FileDescriptor unsealed = make_segment("arbiter-test", kSize);
  EXPECT_THROW(checked_size(unsealed, Seals::kFixedSize), std::runtime_error);
  seal(unsealed, Seals::kFixedSize);
  EXPECT_EQ(checked_size(unsealed, Seals::kFixedSize), kSize);
  EXPECT_THROW(checked_size(unsealed, Seals::kOneWriter), std::runtime_error);
  const Bell bell;
  EXPECT_THROW(checked_size(bell.write_end(), Seals::kFixedSize), std::runtime_error);
  EXPECT_EQ(test::error_of([] { checked_size(FileDescriptor(), Seals::kFixedSize); }),
            "the descriptor of a segment is missing");
}

TEST(Segment, AChildDoesNotInheritAWritableMapping) {
  const FileDescriptor segment = make_segment("arbiter-test", kSize);
  const Mapping writable(segment, kSize, Access::kReadWrite);
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    unsigned char resident[2];
    // ENOMEM: nothing is mapped there.
    _exit(mincore(writable.data(), kSize, resident) != 0 && errno == ENOMEM ? 0 : 1);
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  EXPECT_EQ(status, 0);
}

// From here on a call that would allocate more than `most` bytes is ended by a signal, as kernels
// before 6.8 do it where a timer is fast.
bool interrupt_long_allocations(std::uint32_t most) {
  sock_filter filter[] = {
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, nr)),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_fallocate, 0, 2),
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, args[3])),
      BPF_JUMP(BPF_JMP | BPF_JGT | BPF_K, most, 1, 0),
      BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW),
      BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ERRNO | EINTR),
  };
  const sock_fprog program{sizeof filter / sizeof *filter, filter};
  return prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 &&
         prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program) == 0;
}

TEST(Segment, IsAllocatedThoughEachLongCallIsInterrupted) {
  constexpr std::size_t kBytes = (std::size_t{5} << 20) + 12345;
  const FileDescriptor segment = make_segment("arbiter-test", kBytes + 64);
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    alarm(10);  // one that hangs has failed
    if (!interrupt_long_allocations(std::uint32_t{64} << 10)) _exit(2);
    _exit(allocate(segment, 64, kBytes) ? 1 : 0);
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  EXPECT_EQ(status, 0);
  EXPECT_GE(allocated_size(segment), kBytes);
}

}  // namespace
}  // namespace arbiter::shm
