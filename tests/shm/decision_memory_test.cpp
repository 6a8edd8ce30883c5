// The names of sources: how many of them a process keeps, and for how long.
#include "shm/decision_memory.hpp"

#include <gtest/gtest.h>

#include <set>
#include <string>

namespace arbiter::shm {
namespace {

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
  DecisionMemory memory(make_board(), Residence::kMapped, 0);
  memory.add_page(kAnotherSource, 1, "/other", make_page());
  const std::string& other = memory.source_name(kAnotherSource);
  EXPECT_EQ(places_of_names(memory, 100).size(), 2U);
  EXPECT_EQ(other, "/other");
}

TEST(DecisionMemory, AWatcherHoldsANameWhileItsIdGetsAnother) {
  DecisionMemory memory(make_board(), Residence::kMapped, 0);
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
  DecisionMemory memory(make_board(), Residence::kMapped, 1);
  EXPECT_EQ(places_of_names(memory, 100).size(), 100U);
}

}  // namespace
}  // namespace arbiter::shm
