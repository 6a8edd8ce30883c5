// Samples in receive buffers, in all the shapes that somebody on the network can give them.
#include "gateway/dds/fragments.hpp"

#include <dds/dds.h>
#include <dds/ddsi/q_radmin.h>
#include <gtest/gtest.h>

#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include "gateway/dds/arrived_sample.hpp"

namespace arbiter::gateway::dds {
namespace {

// A chain of fragments, each in a buffer of its own, as Cyclone has them.
class Chain {
 public:
  // The bytes from `from` on.
  void add(std::uint32_t from, const std::string& bytes) {
    constexpr std::size_t kOffset = 20;  // headers of RTPS stand before
    auto& buffer = buffers_.emplace_back(std::make_unique<Buffer>());
    std::memcpy(NN_RMSG_PAYLOADOFF(&buffer->message, kOffset), bytes.data(), bytes.size());
    auto& fragment = fragments_.emplace_back(std::make_unique<nn_rdata>());
    *fragment = {};
    fragment->rmsg = &buffer->message;
    fragment->min = from;
    fragment->maxp1 = from + static_cast<std::uint32_t>(bytes.size());
    fragment->payload_zoff = kOffset;
    if (fragments_.size() > 1) fragments_[fragments_.size() - 2]->nextfrag = fragment.get();
  }
  [[nodiscard]] const nn_rdata* first() const { return fragments_.front().get(); }

  // "-": it cannot be copied.
  [[nodiscard]] std::string copy(std::size_t from, std::size_t count) const {
    std::string copied(count, '?');
    return copy_fragments(first(), from, writable(copied)) ? copied : "-";
  }

 private:
  static WritableBytes writable(std::string& text) {
    return {reinterpret_cast<std::byte*>(text.data()), text.size()};
  }

  struct Buffer {
    nn_rmsg message;
    char bytes[70'000];
  };
  std::vector<std::unique_ptr<Buffer>> buffers_;
  std::vector<std::unique_ptr<nn_rdata>> fragments_;
};

TEST(Fragments, OneIsTheWholeSample) {
  Chain chain;
  chain.add(0, "abcdef");
  EXPECT_EQ(chain.copy(0, 6), "abcdef");
  EXPECT_EQ(chain.copy(2, 3), "cde");
  EXPECT_EQ(chain.copy(6, 0), "");
}

TEST(Fragments, SeveralAreJoined) {
  Chain chain;
  chain.add(0, "abcd");
  chain.add(4, "efgh");
  chain.add(8, "i");
  EXPECT_EQ(chain.copy(0, 9), "abcdefghi");
  EXPECT_EQ(chain.copy(3, 3), "def");
  EXPECT_EQ(chain.copy(5, 4), "fghi");
}

TEST(Fragments, WhereTwoOverlapTheFirstCounts) {
  Chain chain;
  chain.add(0, "abcd");
  chain.add(2, "XYef");
  chain.add(3, "Z");
  chain.add(6, "g");
  EXPECT_EQ(chain.copy(0, 7), "abcdefg");
}

// As large as a datagram may be.
TEST(Fragments, LargeOnesAreJoined) {
  std::string whole(100'000, ' ');
  for (std::size_t i = 0; i < whole.size(); ++i) whole[i] = static_cast<char>(i * i >> 5);
  Chain chain;
  chain.add(0, whole.substr(0, 65'000));
  chain.add(65'000, whole.substr(65'000));
  EXPECT_EQ(chain.copy(0, whole.size()), whole);
  EXPECT_EQ(chain.copy(20'000, 60'000), whole.substr(20'000, 60'000));
}

TEST(Fragments, AGapOrAnEndThatIsMissingIsNotRead) {
  Chain chain;
  chain.add(0, "abcd");
  chain.add(5, "fgh");
  EXPECT_EQ(chain.copy(0, 8), "-");
  EXPECT_EQ(chain.copy(4, 1), "-");
  EXPECT_EQ(chain.copy(5, 3), "fgh");
  EXPECT_EQ(chain.copy(5, 4), "-");
  Chain late;
  late.add(2, "cd");
  EXPECT_EQ(late.copy(0, 4), "-");
}

Payload payload_of_chain(const Chain& chain, std::uint32_t size) {
  Payload payload{};
  payload.size = size;
  payload.fragments = chain.first();
  return payload;
}

TEST(ArrivedSample, KnowsItsByteOrderFromItsHeader) {
  Chain little;
  little.add(0, std::string("\0\1\0\0data", 8));
  const Payload payload = payload_of_chain(little, 8);
  const ArrivedSample sample(payload);
  EXPECT_TRUE(sample.is_readable());
  EXPECT_FALSE(sample.is_big_endian());
  EXPECT_EQ(sample.size(), 8U);
  EXPECT_EQ(sample.data_begin(), 4U);
  Chain big;
  big.add(0, std::string("\0\0\0\0data", 8));
  const Payload other = payload_of_chain(big, 8);
  EXPECT_TRUE(ArrivedSample(other).is_big_endian());
}

TEST(ArrivedSample, ThatIsShorterThanAHeaderOrHasAnUnknownOneCannotBeRead) {
  Chain chain;
  chain.add(0, std::string("\0\1", 2));
  const Payload cut = payload_of_chain(chain, 2);
  EXPECT_FALSE(ArrivedSample(cut).is_readable());
  const Payload lying = payload_of_chain(chain, 100);
  EXPECT_FALSE(ArrivedSample(lying).is_readable());
  for (const char* const header : {"\1\1\0\0", "\0\4\0\0", "\0\5\0\0", "\0\x0c\0\0"}) {
    Chain unknown;
    unknown.add(0, std::string(header, 4) + "data");
    const Payload payload = payload_of_chain(unknown, 8);
    EXPECT_FALSE(ArrivedSample(payload).is_readable());
  }
}

TEST(PayloadPool, GivesBackWhatItWasGiven) {
  PayloadPool& pool = PayloadPool::of_process();
  Payload* const first = pool.take(100);
  ASSERT_NE(first, nullptr);
  std::memset(first->bytes(), 0x55, 100);
  pool.give_back(first);
  Payload* const again = pool.take(128);  // as large as those for 100 are
  EXPECT_EQ(again, first);
  Payload* const larger = pool.take(129);
  EXPECT_NE(larger, first);
  pool.give_back(again);
  pool.give_back(larger);
  EXPECT_EQ(pool.take(std::size_t{1} << 40), nullptr);
}

}  // namespace
}  // namespace arbiter::gateway::dds
