// Ports that are tapped on a thread of their own.
#include "top/tapper.hpp"

#include <gtest/gtest.h>

#include <cstddef>
#include <set>
#include <string>

#include "tests/support/daemon.hpp"

namespace arbiter::top {
namespace {

// With a daemon that is stopped, each of them would take its second.
TEST(TopTapper, OpensNoFurtherTapsOnceItIsToEnd) {
  const test::Daemon daemon("<behaviors/>");
  std::set<std::string> ports;
  for (std::size_t i = 0; i < 500; ++i) ports.insert("/p" + std::to_string(i) + ":i");
  {
    Tapper tapper(daemon.instance());
    tapper.watch(ports);
  }
  EXPECT_EQ(daemon.log().find(" taps the input port /p9:i"), std::string::npos)
      << "the last of them";
}

}  // namespace
}  // namespace arbiter::top
