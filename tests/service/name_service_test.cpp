// A name service may ask a network that is not there. Nobody's call waits for that who can do
// without.
#include <gtest/gtest.h>
#include <pwd.h>
#include <sys/types.h>

#include <cerrno>
#include <cstddef>

#include "service/policy/users.hpp"

namespace {

int asked = 0;

}  // namespace

// In the place of the C library's, for this program.
extern "C" int getpwuid_r(uid_t, passwd*, char*, size_t, passwd** found) {
  ++asked;
  *found = nullptr;
  return ENOENT;
}

namespace arbiter::test {
namespace {

TEST(NameServices, AreNotAskedForTheNameOfWhoIsRefused) {
  asked = 0;
  EXPECT_EQ(service::describe_user(0), "root (0)");
  EXPECT_EQ(service::describe_user(4'242'424), "4242424");
  EXPECT_EQ(asked, 0);
}

}  // namespace
}  // namespace arbiter::test
