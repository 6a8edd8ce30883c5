// The files of a mapping: from the disk, and as they were kept.
#include "gateway/core/kept_files.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <string>

#include "rules/text/text_file.hpp"
#include "shm/file_descriptor.hpp"
#include "tests/support/temporary_directory.hpp"

namespace arbiter::gateway {
namespace {

// A gateway that reads its mapping again serves on the same thread: a pipe would hold it up.
TEST(KeptFiles, OfAGatewayThatServesAreRegularFiles) {
  int ends[2];
  ASSERT_EQ(::pipe2(ends, O_CLOEXEC), 0);
  const shm::FileDescriptor read_end(ends[0]);
  ASSERT_EQ(::write(ends[1], "text", 4), 4);
  ::close(ends[1]);
  const std::string pipe = "/proc/self/fd/" + std::to_string(ends[0]);
  KeptFiles kept;
  EXPECT_THROW(kept.from_disk(true)(pipe, 100, rules::Accept::kAnyFile), rules::FileError);
  EXPECT_EQ(kept.from_disk(false)(pipe, 100, rules::Accept::kAnyFile), "text") << "at its start";
}

// More than it may have is more also as a copy.
TEST(KeptFiles, ThatAreTooLargeAreToo) {
  const test::TemporaryDirectory files;
  const std::string mapping = files.write("mapping", std::string(200, 'x'));
  KeptFiles kept;
  EXPECT_GT(kept.from_disk(false)(mapping, 100, rules::Accept::kAnyFile).size(), 100u);
  EXPECT_GT(kept.kept()(mapping, 100, rules::Accept::kAnyFile).size(), 100u);
}

}  // namespace
}  // namespace arbiter::gateway
