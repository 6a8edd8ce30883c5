// Activity pages that the service manager has kept: what it costs to take them.
#include <dlfcn.h>
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <string>
#include <vector>

#include "service/models/board.hpp"
#include "service/policy/shares.hpp"
#include "service/ports/port_names.hpp"

namespace {

std::size_t looks_at_files = 0;

}  // namespace

// In the place of the C library's, for this program.
extern "C" int fstat(int file, struct stat* status) noexcept {
  using Fstat = int (*)(int, struct stat*);
  static const auto next = reinterpret_cast<Fstat>(::dlsym(RTLD_NEXT, "fstat"));
  ++looks_at_files;
  return next(file, status);
}

namespace arbiter::service {
namespace {

// A daemon's names, and what its successor takes of their pages.
class StoredPages : public testing::Test {
 protected:
  static constexpr std::size_t kSources = 64;

  StoredPages() {
    for (std::size_t i = 0; i < kSources; ++i) {
      const Source& source = names_.source("/s" + std::to_string(i));
      stored_.push_back(
          {"page-" + std::to_string(source.id) + '-' + std::to_string(source.page_number),
           shm::reopen(source.page.writable, O_RDWR)});
    }
    successors_board_.inherit(board_.readable());
    successors_.restore(board_.in_use());
  }

  struct Stored {
    std::string name;
    shm::FileDescriptor page;
  };
  Totals totals_{1'000'000, 1'000'000, 1'000'000, 1'000'000, 1'000'000, 1'000'000};
  Shares shares_{totals_, Shares::kDefaultPercent, ::geteuid()};
  Registry registry_;
  PortNames names_{registry_, shares_, false};
  Board board_{names_, registry_};
  PortNames successors_{registry_, shares_, false};
  Board successors_board_{successors_, registry_};
  std::vector<Stored> stored_;
};

// 4000 of them took 11 seconds, in which nobody was served.
TEST_F(StoredPages, TheLastCostsNoMoreThanTheFirst) {
  std::vector<std::size_t> costs;
  for (const Stored& each : stored_) {
    const std::size_t before = looks_at_files;
    EXPECT_TRUE(successors_.take_stored_page(each.name, each.page));
    costs.push_back(looks_at_files - before);
  }
  EXPECT_EQ(costs.back(), costs.front());
  for (const auto& source : successors_.sources()) EXPECT_TRUE(source->has_page());
}

TEST_F(StoredPages, AreTakenOnlyForWhatTheyAre) {
  EXPECT_FALSE(successors_.take_stored_page(stored_[0].name, stored_[1].page));
  for (const char* name : {"", "page-", "page-x-1", "page-99999999999-1", "page-5000-1", "else"}) {
    EXPECT_FALSE(successors_.take_stored_page(name, stored_[0].page)) << name;
  }
  for (const auto& source : successors_.sources()) EXPECT_FALSE(source->has_page());
}

}  // namespace
}  // namespace arbiter::service
