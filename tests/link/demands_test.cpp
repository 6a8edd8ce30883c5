// How an importer's demand gets into what DDS tells others: link/dds/demands.hpp.
#include "link/dds/demands.hpp"

#include <gtest/gtest.h>

#include <map>
#include <mutex>

#include "tests/link/scene.hpp"

namespace arbiter::test {
namespace {

// Cyclone, which returns what it is told to for the first word of each reader, and is content
// after.
class Words {
 public:
  explicit Words(dds_return_t first) : first_(first) {}
  [[nodiscard]] link::DemandTeller::Set set() {
    return [this](dds_entity_t reader, const link::ByteString& data) {
      const std::lock_guard lock(mutex_);
      last_ = data;
      return ++counts_[reader] == 1 ? first_ : DDS_RETCODE_OK;
    };
  }
  [[nodiscard]] int count(dds_entity_t reader) const {
    const std::lock_guard lock(mutex_);
    const auto found = counts_.find(reader);
    return found == counts_.end() ? 0 : found->second;
  }
  [[nodiscard]] link::ByteString last() const {
    const std::lock_guard lock(mutex_);
    return last_;
  }

 private:
  const dds_return_t first_;
  mutable std::mutex mutex_;
  std::map<dds_entity_t, int> counts_;
  link::ByteString last_;
};

// Or the source would not be believed until its demand changes.
TEST(DemandTeller, SaysAgainWhatCouldNotBeSaid) {
  Words words(DDS_RETCODE_OUT_OF_RESOURCES);
  link::DemandTeller teller(words.set());
  const link::DemandCard card{5, link::Demand::kHeaders};
  ASSERT_TRUE(teller.tell(1, card));
  await([&] { return words.count(1) == 2; });
  EXPECT_EQ(words.last(), link::write_demand_card(card));
}

TEST(DemandTeller, PassesOverAReaderThatIsGone) {
  Words words(DDS_RETCODE_BAD_PARAMETER);
  link::DemandTeller teller(words.set());
  ASSERT_TRUE(teller.tell(1, {5, link::Demand::kHeaders}));
  await([&] { return words.count(1) == 1; });
  ASSERT_TRUE(teller.tell(2, {5, link::Demand::kHeaders}));
  await([&] { return words.count(2) == 1; });
  ASSERT_TRUE(teller.tell(3, {5, link::Demand::kHeaders}));
  await([&] { return words.count(3) == 1; });
  EXPECT_EQ(words.count(1), 1);
}

}  // namespace
}  // namespace arbiter::test
