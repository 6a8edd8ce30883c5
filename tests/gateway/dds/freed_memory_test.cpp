#include "gateway/dds/freed_memory.hpp"

#include <gtest/gtest.h>
#include <malloc.h>
#include <sys/resource.h>

#include <cstddef>
#include <cstdlib>
#include <vector>

#include "gateway/dds/payload.hpp"

namespace arbiter::gateway::dds {
namespace {

constexpr std::size_t kBlock = std::size_t{1} << 20;
constexpr std::size_t kPage = 4096;

long faults_of_this_thread() {
  rusage usage{};
  ::getrusage(RUSAGE_THREAD, &usage);
  return usage.ru_minflt;
}

// As Cyclone does with a sample of some MiB.
void receive_and_forget() {
  std::vector<void*> blocks;
  for (int i = 0; i < 4; ++i) {
    auto* const block = static_cast<std::byte*>(std::malloc(kBlock));
    for (std::size_t at = 0; at < kBlock; at += kPage) block[at] = std::byte{1};
    blocks.push_back(block);
  }
  for (void* const block : blocks) std::free(block);
}

TEST(FreedMemory, IsReceivedIntoAgainWithoutFaults) {
  keep_freed_memory();
  receive_and_forget();
  const long before = faults_of_this_thread();
  constexpr int kRounds = 50;
  for (int i = 0; i < kRounds; ++i) receive_and_forget();
  EXPECT_LT(faults_of_this_thread() - before, kRounds) << "of 1024 pages in each round";
}

// Else one map in the morning would keep its memory from everybody all day.
TEST(FreedMemory, OfHugeSamplesIsGivenBackToTheKernel) {
  constexpr std::size_t kSize = std::size_t{200} << 20;
  const std::size_t before = ::mallinfo2().hblkhd;
  PayloadPool& pool = PayloadPool::of_process();
  Payload* const payload = pool.take(kSize);
  ASSERT_NE(payload, nullptr);
  EXPECT_GE(::mallinfo2().hblkhd, before + kSize);
  pool.give_back(payload);
  EXPECT_EQ(::mallinfo2().hblkhd, before);
}

}  // namespace
}  // namespace arbiter::gateway::dds
