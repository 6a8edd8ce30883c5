// A flight recorder whose disk is full.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sched.h>
#include <sys/mount.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <thread>

#include "tests/recorder/fed_ring.hpp"

namespace arbiter::test {
namespace {

using testing::HasSubstr;
using testing::SizeIs;

class RingDisk : public RingTest {
 protected:
  // Runs it where the directory is a disk of 300 KiB. Empty, or why that cannot be.
  std::string on_small_disk(const std::function<void()>& run) {
    std::string why_not;
    std::thread([&] {
      const std::string path = directory_.path();
      const bool is_there = ::unshare(CLONE_NEWNS) == 0 &&
                            ::mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) == 0 &&
                            ::mount("tmpfs", path.c_str(), "tmpfs", 0, "size=300k,mode=700") == 0;
      if (!is_there) {
        why_not = std::string("no disk of its own: ") + std::strerror(errno);
      } else {
        run();
      }
    }).join();
    return why_not;
  }
  // With so many payloads of nearly 10 KiB.
  static void fill(recorder::Ring& ring, int payloads) {
    Incident incident;
    for (int i = 0; i < payloads; ++i) {
      incident.arrive("/low", 1010 + i, 1011 + i, Incident::Fate::accepted);
      incident.put_payload(10'000);
    }
    feed(ring, incident);
  }
  recorder::RingOptions uncompressed() {
    auto settings = options(60 * kSecond, 1 << 20);
    settings.file.compression = recording::Compression::none;
    settings.wall_offset = [this] { return kSecond * ++attempts_; };  // each has a name of its own
    return settings;
  }

  int attempts_ = 0;
};

TEST_F(RingDisk, ItsOldestFilesMakeRoomForNewOnes) {
  const std::string why_not = on_small_disk([&] {
    recorder::Ring ring(uncompressed());
    fill(ring, 6);
    constexpr int kFiles = 9;
    for (int i = 0; i < kFiles; ++i) {  // somebody asks for the first, and for the last
      ring.request(i % (kFiles - 1) == 0 ? recorder::Cause::asked : recorder::Cause::when);
      tick(ring, (1 + 20 * i) * kSecond);
      ASSERT_EQ(told_.back().error, "");
      EXPECT_TRUE(recording::read_mcap(written_.back(), {}).is_whole);
    }
    EXPECT_THAT(told_.back().removed, SizeIs(1));
    EXPECT_TRUE(std::filesystem::exists(written_.at(0))) << "somebody has asked for it";
    std::vector<std::string> removed;
    for (const auto& each : told_) {
      removed.insert(removed.end(), each.removed.begin(), each.removed.end());
    }
    ASSERT_GE(removed.size(), 5u);
    for (std::size_t i = 0; i < removed.size(); ++i) {
      EXPECT_EQ(removed[i], written_.at(i + 1)) << "the oldest first";
    }
    EXPECT_EQ(count_of_files(), kFiles - removed.size());
  });
  if (!why_not.empty()) GTEST_SKIP() << why_not;
}

// It does not give up all that it has for nothing.
TEST_F(RingDisk, KeepsItsFilesWhereOthersFillTheDisk) {
  fails_ = true;
  const std::string why_not = on_small_disk([&] {
    recorder::Ring ring(uncompressed());
    for (int i = 0; i < 6; ++i) {  // each with next to nothing in it
      ring.request(recorder::Cause::when);
      tick(ring, (1 + 20 * i) * kSecond);
    }
    fill(ring, 40);  // more than there is room for
    std::ofstream(directory_.file("others")) << std::string(1 << 20, 'x');
    const auto attempt = [&](int time) {
      ring.request(recorder::Cause::when);
      tick(ring, time * kSecond);
      EXPECT_EQ(told_.back().file, "");
      EXPECT_THAT(told_.back().error, HasSubstr("No space left on device"));
      return told_.back().removed.size();
    };
    EXPECT_EQ(attempt(200), 4u);
    EXPECT_EQ(attempt(220), 1u);
    EXPECT_EQ(attempt(240), 0u) << "the newest stays";
    ASSERT_TRUE(std::filesystem::exists(written_.at(5)));
    EXPECT_EQ(count_of_files(), 1u);
    EXPECT_TRUE(recording::read_mcap(written_.at(5), {}).is_whole);
    EXPECT_FALSE(std::filesystem::exists(directory_.file("flight.part")));
  });
  if (!why_not.empty()) GTEST_SKIP() << why_not;
}

}  // namespace
}  // namespace arbiter::test
