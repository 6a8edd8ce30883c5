// What a process keeps of sources: their names, and the pages that the next daemon is handed back.
#include "shm/decision_memory.hpp"

#include <gtest/gtest.h>

#include <set>
#include <string>
#include <vector>

#include "tests/support/descriptor_limit.hpp"

namespace arbiter::shm {
namespace {

using Whose = DecisionMemory::Whose;

constexpr SourceId kRenamedSource = 0, kAnotherSource = 1;

FileDescriptor make_board() {
  FileDescriptor board = make_segment("board", sizeof(Board));
  const Mapping mapping(board, sizeof(Board), Access::kReadWrite);
  TableWriter::initialize(*mapping.as<Board>());
  seal(board, Seals::kFixedSize);
  return board;
}

FileDescriptor make_page() {
  FileDescriptor page = make_segment("page", sizeof(ActivityPage));
  seal(page, Seals::kFixedSize);
  return page;
}

// The places of all names that an id has had, one after the other.
std::set<const std::string*> places_of_names(DecisionMemory& memory, PageNumber count) {
  std::set<const std::string*> places;
  for (PageNumber number = 1; number <= count; ++number) {
    const std::string name = "/" + std::to_string(number);
    memory.add_page(kRenamedSource, number, name, make_page());
    EXPECT_EQ(memory.source_name(kRenamedSource), name);
    places.insert(&memory.source_name(kRenamedSource));
  }
  return places;
}

// Whoever may open output ports makes new names without end.
TEST(DecisionMemory, AWatcherKeepsTwoNamesOfAnId) {
  DecisionMemory memory(make_board(), Residence::kMapped, Whose::kWatchers);
  memory.add_page(kAnotherSource, 1, "/other", make_page());
  const std::string& other = memory.source_name(kAnotherSource);
  EXPECT_EQ(places_of_names(memory, 100).size(), 2U);
  EXPECT_EQ(other, "/other");
}

TEST(DecisionMemory, AWatcherHoldsANameWhileItsIdGetsAnother) {
  DecisionMemory memory(make_board(), Residence::kMapped, Whose::kWatchers);
  for (PageNumber number = 1; number < 10; ++number) {
    memory.add_page(kRenamedSource, number, std::to_string(number), make_page());
    const std::string& held = memory.source_name(kRenamedSource);
    memory.add_page(kRenamedSource, number + 1, std::to_string(number + 1), make_page());
    EXPECT_EQ(held, std::to_string(number));
    EXPECT_EQ(memory.source_name(kRenamedSource), std::to_string(number + 1));
  }
}

// Its ports' threads may hold any of them.
TEST(DecisionMemory, AComponentKeepsEachName) {
  DecisionMemory memory(make_board(), Residence::kMapped, Whose::kComponents);
  EXPECT_EQ(places_of_names(memory, 100).size(), 100U);
}

// A component whose board the test writes, as the daemon would.
class PagesOfAComponent : public testing::Test {
 protected:
  void show(SourceId id, PageNumber number) { memory_.add_page(id, number, "/s", make_page()); }
  void put_in_force(SourceId id, PageNumber number) { daemon_.give_page(id, number); }
  std::vector<PageNumber> numbers_at_hand() {
    std::vector<PageNumber> numbers;
    for (const auto& page : memory_.pages_at_hand()) numbers.push_back(page.number);
    return numbers;
  }

  const FileDescriptor board_ = make_board();
  const Mapping mapping_{board_, sizeof(Board), Access::kReadWrite};
  TableWriter daemon_{*mapping_.as<Board>()};
  DecisionMemory memory_{duplicate(board_.get()), Residence::kMapped, Whose::kComponents};
};

// Perhaps nobody else has one of them: then what is active by it is lost with the daemon.
TEST_F(PagesOfAComponent, AreAllHandedBackWhereItsLimitAllows) {
  const test::DescriptorLimit limit(1024);
  for (SourceId id = 0; id < 600; ++id) show(id, 1);
  EXPECT_EQ(numbers_at_hand().size(), 600u);
}

TEST_F(PagesOfAComponent, LeaveDescriptorsForItsPorts) {
  const test::DescriptorLimit limit(64);
  for (SourceId id = 0; id < 100; ++id) show(id, 1);
  EXPECT_LE(numbers_at_hand().size(), 48u);
  EXPECT_GE(numbers_at_hand().size(), 16u);
}

TEST_F(PagesOfAComponent, AreNotHandedBackOnceAnotherIsInForce) {
  for (const PageNumber number : {1U, 2U}) show(kRenamedSource, number);
  put_in_force(kRenamedSource, 1);
  EXPECT_EQ(numbers_at_hand(), (std::vector<PageNumber>{2, 1}));
  put_in_force(kRenamedSource, 2);
  EXPECT_EQ(numbers_at_hand(), (std::vector<PageNumber>{2}));
}

TEST_F(PagesOfAComponent, GiveWayToThoseThatAreInForce) {
  const test::DescriptorLimit limit(64);
  for (SourceId id = 0; id < 100; ++id) show(id, 1);
  for (SourceId id = 0; id < 100; ++id) put_in_force(id, 2);
  show(kRenamedSource, 2);
  EXPECT_EQ(numbers_at_hand(), (std::vector<PageNumber>{2}));
}

// By another daemon, which did not get it from here.
TEST_F(PagesOfAComponent, ShownAgainStayWhereTheyAre) {
  const FileDescriptor page = make_page();
  memory_.add_page(kRenamedSource, 1, "/s", duplicate(page.get()));
  const std::uint64_t changes = memory_.pages().changes();
  memory_.add_page(kRenamedSource, 1, "/s", duplicate(page.get()));
  EXPECT_EQ(memory_.pages().changes(), changes) << "nobody was blind for a moment";
  show(kRenamedSource,
       1);  // it has died before that came into force, and its successor made its own
  EXPECT_GT(memory_.pages().changes(), changes);
}

}  // namespace
}  // namespace arbiter::shm
