// A flight recorder's memory, the files that it writes, and who asks for them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <memory>
#include <set>
#include <thread>

#include "evidence/verification.hpp"
#include "recorder/dump_socket.hpp"
#include "shm/clock.hpp"
#include "tests/recorder/fed_ring.hpp"
#include "tests/support/other_user.hpp"

namespace arbiter::test {
namespace {

using testing::HasSubstr;
using testing::SizeIs;

TEST_F(RingTest, AnswersEachRequestWithItsOwnFile) {
  recorder::Ring ring(options(60 * kSecond, 1 << 20));
  const auto death = ring.request(recorder::Cause::death);
  const auto asked = ring.request(recorder::Cause::asked);
  const auto again = ring.request(recorder::Cause::asked);
  tick(ring, kSecond);
  ASSERT_THAT(told_, SizeIs(2));  // those that ask at one moment share a file
  EXPECT_EQ(told_[0].requests, (std::vector<std::uint64_t>{asked, again}));
  EXPECT_THAT(told_[0].file, HasSubstr("-asked.mcap"));
  EXPECT_EQ(told_[1].requests, (std::vector<std::uint64_t>{death}));
  EXPECT_THAT(told_[1].file, HasSubstr("-death.mcap"));
}

TEST_F(RingTest, SaysUntilWhenAFileReaches) {
  recorder::Ring ring(options(60 * kSecond, 1 << 20));
  const Incident incident;
  for (const auto& record : incident.records()) {
    ring.write(std::make_shared<const evidence::Record>(record));
  }
  ring.request(recorder::Cause::asked);
  const evidence::Nanoseconds asked = shm::monotonic_now();
  ring.tick(asked, asked + 1);
  ASSERT_THAT(told_, SizeIs(1));
  EXPECT_EQ(evidence::load_recording(told_[0].file).runs.at(0).end, asked + 1);
}

// One who asks while another's request waits is not answered with a file of before.
TEST_F(RingTest, WritesWhatHasHappenedBeforeItWasAsked) {
  recorder::Ring ring(options(60 * kSecond, 1 << 20));
  const auto first = ring.request(recorder::Cause::asked);
  const evidence::Nanoseconds between = shm::monotonic_now();
  while (shm::monotonic_now() == between) {
  }
  const auto second = ring.request(recorder::Cause::asked);
  ring.tick(between, between);
  ASSERT_THAT(told_, SizeIs(1));
  EXPECT_EQ(told_[0].requests, (std::vector<std::uint64_t>{first}));
  tick(ring, kSecond);
  ASSERT_THAT(told_, SizeIs(2));
  EXPECT_EQ(told_[1].requests, (std::vector<std::uint64_t>{second}));
}

TEST_F(RingTest, HoldsABoundedNumberOfRequests) {
  recorder::Ring ring(options(60 * kSecond, 1 << 20));
  std::set<std::uint64_t> numbers;
  for (int i = 0; i < 10'000; ++i) numbers.insert(ring.request(recorder::Cause::when));
  EXPECT_LE(numbers.size(), 100u);
  tick(ring, kSecond);
  ASSERT_THAT(told_, SizeIs(1));
  EXPECT_EQ(told_[0].requests.size(), numbers.size());
}

TEST_F(RingTest, AFileOfItsOwnAccordShowsWhatCameOfItsReason) {
  auto settings = options(60 * kSecond, 1 << 20);
  settings.after = 2 * kSecond;
  recorder::Ring ring(settings);
  feed(ring, Incident());
  const evidence::Nanoseconds before = shm::monotonic_now();
  ring.request(recorder::Cause::death);
  ring.request(recorder::Cause::asked);
  const evidence::Nanoseconds requested = shm::monotonic_now();
  ring.tick(requested, before + 2 * kSecond - 1);
  ASSERT_THAT(told_, SizeIs(1));
  EXPECT_THAT(told_[0].file, HasSubstr("-asked.mcap")) << "whoever asks does not wait";
  ring.tick(requested, requested + 2 * kSecond);
  ASSERT_THAT(told_, SizeIs(2));
  EXPECT_THAT(told_[1].file, HasSubstr("-death.mcap"));
  EXPECT_EQ(evidence::load_recording(told_[1].file).runs.at(0).end, requested + 2 * kSecond);
  ring.request(recorder::Cause::when);
  ring.finish(requested + 2 * kSecond);
  EXPECT_THAT(told_, SizeIs(3)) << "at the end nothing waits";
}

TEST_F(RingTest, WaitsForNoLongerThanHalfOfWhatItKeeps) {
  auto settings = options(2 * kSecond, 1 << 20);
  settings.after = 60 * kSecond;
  recorder::Ring ring(settings);
  ring.request(recorder::Cause::death);
  const evidence::Nanoseconds requested = shm::monotonic_now();
  ring.tick(requested, requested + kSecond);
  EXPECT_THAT(told_, SizeIs(1));
}

// Where samples come so fast that the memory keeps less than that.
TEST_F(RingTest, WritesBeforeWhatLedToItHasGivenWay) {
  auto settings = options(60 * kSecond, 64 << 10);
  settings.after = 10 * kSecond;
  recorder::Ring ring(settings);
  ring.request(recorder::Cause::death);
  const evidence::Nanoseconds now = shm::monotonic_now();
  const evidence::Nanoseconds ago = now - 5 * kSecond;
  Incident incident;
  for (int i = 0; i < 10; ++i) incident.arrive("/high", ago + i, now, Incident::Fate::accepted);
  feed(ring, incident);
  ring.tick(now, now);
  EXPECT_THAT(told_, SizeIs(0)) << "nothing has given way";
  Incident more;
  for (int i = 0; i < 1000; ++i) more.arrive("/high", ago + i, now, Incident::Fate::accepted);
  feed(ring, more);
  ring.tick(now, now);
  EXPECT_THAT(told_, SizeIs(1));
}

// A statement that flips all the time.
TEST_F(RingTest, RestsAfterAFileThatNobodyHasAskedFor) {
  recorder::Ring ring(options(60 * kSecond, 1 << 20));
  for (int i = 0; i <= 250; ++i) {  // 25 seconds
    ring.request(recorder::Cause::when);
    tick(ring, kSecond + i * kSecond / 10);
  }
  EXPECT_THAT(told_, SizeIs(3));  // at 0, 10 and 20 s
  ring.request(recorder::Cause::death);
  ring.request(recorder::Cause::asked);
  tick(ring, 27 * kSecond);
  EXPECT_THAT(told_, SizeIs(5)) << "other causes do not wait";
  ring.finish(kLater);
  EXPECT_THAT(told_, SizeIs(6)) << "at the end nothing is left out";
}

TEST_F(RingTest, RestsForNoLongerThanHalfOfWhatItKeeps) {
  recorder::Ring ring(options(2 * kSecond, 1 << 20));
  for (int i = 0; i < 3; ++i) {
    ring.request(recorder::Cause::when);
    tick(ring, kSecond + i * kSecond);
  }
  EXPECT_THAT(told_, SizeIs(3));
}

TEST_F(RingTest, KeepsTheLastOfItsOwnFilesAndTouchesNoOthers) {
  const std::string asked = [&] {
    recorder::Ring ring(options(60 * kSecond, 1 << 20));
    ring.request(recorder::Cause::asked);
    tick(ring, kSecond);
    return written_.back();
  }();
  const std::string strange = directory_.write("flight-20200101T000000Z-when.mcap", "mine");
  std::string kept;
  std::string replaced;
  for (int run = 0; run < 2; ++run) {  // the second knows what the first has written
    auto settings = options(60 * kSecond, 1 << 20);
    settings.keep = 3;
    recorder::Ring ring(settings);
    for (int i = 0; i < 5; ++i) {
      ring.request(i % 2 == 0 ? recorder::Cause::when : recorder::Cause::death);
      tick(ring, (1 + 20 * i) * kSecond);
      if (run != 0 || i > 1) continue;
      // Somebody moves the first away, and puts something else in the place of the second.
      const std::string file = written_.back();
      (i == 0 ? kept : replaced) = i == 0 ? file + ".kept" : file;
      std::filesystem::rename(file, i == 0 ? kept : directory_.file("moved"));
      if (i == 1) std::ofstream(replaced) << "other";
    }
  }
  std::size_t removed = 0;
  for (const auto& each : told_) removed += each.removed.size();
  EXPECT_EQ(removed, 10u - 2 - 3);
  for (const std::string& file : {asked, strange, kept, replaced}) {
    EXPECT_TRUE(std::filesystem::exists(file)) << file;
  }
  EXPECT_EQ(count_of_files(), 3u + 3);  // with the one that was asked for, and two of others
  for (std::size_t i = written_.size() - 3; i < written_.size(); ++i) {
    EXPECT_TRUE(recording::read_mcap(written_[i], {}).is_whole) << written_[i];
  }
}

// A robot without a clock of its own boots, and its clock is set once it has a network.
TEST_F(RingTest, FilesHaveTheWallClockOfTheirOwnTime) {
  constexpr std::int64_t k2030 = 1'893'456'000 * kSecond;
  std::int64_t offset = 0;
  auto settings = options(60 * kSecond, 1 << 20);
  settings.info.wall_offset = 7;  // as it was when the recorder started
  settings.wall_offset = [&] { return offset; };
  recorder::Ring ring(settings);
  feed(ring, Incident());
  for (const std::int64_t each : {std::int64_t{0}, k2030}) {
    offset = each;
    ring.request(recorder::Cause::asked);
    tick(ring, kSecond);
    EXPECT_THAT(written_.back(), HasSubstr(each == 0 ? "/flight-1970" : "/flight-2030"));
    EXPECT_EQ(evidence::load_recording(written_.back()).about.wall_offset, each);
  }
}

// As where the disk is full.
TEST_F(RingTest, LeavesNoPartOfAFileThatCannotBeWritten) {
  fails_ = true;
  recorder::Ring ring(options(60 * kSecond, 1 << 20));
  Incident incident;
  for (const auto& record : incident.records()) {
    ring.write(std::make_shared<const evidence::Record>(record));
  }
  const auto before = ::signal(SIGXFSZ, SIG_IGN);
  rlimit limit{};
  ::getrlimit(RLIMIT_FSIZE, &limit);
  const rlimit small{512, limit.rlim_max};
  ::setrlimit(RLIMIT_FSIZE, &small);
  ring.request(recorder::Cause::asked);
  tick(ring, kSecond);
  ::setrlimit(RLIMIT_FSIZE, &limit);
  ::signal(SIGXFSZ, before);
  ASSERT_THAT(told_, SizeIs(1));
  EXPECT_EQ(told_[0].file, "");
  EXPECT_THAT(told_[0].error, HasSubstr("File too large; it was deleted"));
  EXPECT_TRUE(std::filesystem::is_empty(directory_.path()));
  ring.request(recorder::Cause::asked);
  tick(ring, kSecond);
  EXPECT_EQ(told_.back().error, "");
  EXPECT_TRUE(recording::read_mcap(told_.back().file, {}).is_whole);
}

// Whoever asks is answered with what was written for that, and with nothing else.
TEST(DumpSocket, AnswersWithTheFileThatWasAskedFor) {
  const TemporaryDirectory directory;
  const std::string prefix = directory.file("flight");
  recorder::DumpSocket socket(prefix);
  std::string answer;
  std::thread asking([&] { answer = recorder::ask_for_dump(prefix, shm::kForever); });
  std::uint64_t asked = 0;
  while (asked == 0) socket.accept([&] { return asked = 7; });
  socket.answer(6, "written another\n");
  socket.answer(7, "written it\n");
  asking.join();
  EXPECT_EQ(answer, "written it\n");
}

TEST(DumpSocket, SaysThatAnotherUserMayNotAsk) {
  if (!may_be_another_user()) GTEST_SKIP() << "only root can be another user";
  const TemporaryDirectory directory;
  ASSERT_EQ(::chmod(directory.path().c_str(), 0755), 0);
  const std::string prefix = directory.file("flight");
  const recorder::DumpSocket socket(prefix);
  const auto ask = [](const std::string& whom) {
    return as_user(kStranger, [&] { return recorder::ask_for_dump(whom, shm::kForever); });
  };
  EXPECT_THAT(ask(prefix), HasSubstr("permission denied: only the user who has started the "));
  EXPECT_THAT(ask(directory.file("another")), HasSubstr("no flight recorder writes to "));
}

TEST_F(RingTest, WritesAllThatItHasIfNothingHasLeft) {
  Incident incident;
  incident.arrive("/low", 1010, 1011, Incident::Fate::accepted);
  recorder::Ring ring(options(1'000'000, 1 << 20));
  const auto recorded = dump(ring, incident);
  ASSERT_THAT(recorded.runs, SizeIs(1));
  EXPECT_EQ(recorded.runs[0].start, 1000);
  EXPECT_THAT(recorded.runs[0].decisions, SizeIs(1));
}

TEST_F(RingTest, BeginsWithTheStateOfAllThatHasLeft) {
  Incident incident;
  incident.arrive("/high", 1100, 1105, Incident::Fate::accepted);
  incident.arrive("/low", 1110, 1111, Incident::Fate::discarded);
  for (int i = 0; i < 10; ++i) {
    incident.arrive("/low", 1200 + i * 20, 1201 + i * 20, Incident::Fate::discarded);
  }
  recorder::Ring ring(options(100, 1 << 20));
  const auto recorded = dump(ring, incident);
  ASSERT_THAT(recorded.runs, SizeIs(1));
  const auto& run = recorded.runs[0];
  EXPECT_GE(run.start, 1240);
  EXPECT_LE(run.decisions.size(), 6u);
  EXPECT_EQ(run.sources.at("/high").steps.at(0).word, shm::arrival(1100, 500));
  evidence::Models models(compile_texts);
  const auto result = verify(recorded, models);
  EXPECT_EQ(result.equal, run.decisions.size());
}

// Nobody wins from 1300 on; a file that began before would say so of the time before, too.
TEST_F(RingTest, BeginsBehindTheLastChangeOfWinnerThatHasLeft) {
  using Change = evidence::WinnerChange;
  Incident incident;
  incident.arrive("/high", 1100, 1105, Incident::Fate::accepted);
  incident.add(Change{"/in", "/high", "", 1100, Change::Why::arrival, "/high", 1});
  incident.add(Change{"/in", "", "/high", 1300, Change::Why::expiry, "/high", 1});
  incident.add(Change{"/other", "/low", "", 1310, Change::Why::expiry, "/high", 1});
  incident.arrive("/low", 2000, 2001, Incident::Fate::accepted);
  recorder::Ring ring(options(100, 1 << 20));
  const auto recorded = dump(ring, incident);
  ASSERT_THAT(recorded.runs, SizeIs(1));
  EXPECT_EQ(recorded.runs[0].start, 1310);
  ASSERT_THAT(recorded.runs[0].winners, SizeIs(1));
  EXPECT_EQ(recorded.runs[0].winners[0].winner, "/low");
  EXPECT_EQ(recorded.runs[0].winners[0].by, "") << "what it began with, nobody has caused";
}

TEST_F(RingTest, ATimeInTheFutureForgetsNothing) {
  constexpr evidence::Nanoseconds kHour = 3600'000'000'000;
  recorder::Ring ring(options(kHour, 1 << 20));
  const evidence::Nanoseconds now = shm::monotonic_now();
  Incident incident;
  incident.arrive("/low", now - 1'000'000, now - 999'999, Incident::Fate::accepted);
  incident.arrive("/high", now + 2 * kHour, now + 2 * kHour, Incident::Fate::accepted);
  EXPECT_THAT(dump(ring, incident).runs.at(0).decisions, SizeIs(2));
}

TEST_F(RingTest, PortsOfAnEarlierDaemonAreForgotten) {
  recorder::Ring ring(options(10, 1 << 20));
  Incident incident;
  evidence::PortChange port;
  port.port = "/gone";
  port.seen = 1001;
  incident.add(port);
  incident.add(evidence::Start{5000, "", {}, "none"});
  incident.arrive("/low", 6000, 6001, Incident::Fate::accepted);
  incident.arrive("/low", 7000, 7001, Incident::Fate::accepted);
  dump(ring, incident);
  evidence::read_recording(written_.back(), evidence::Payloads::pass_over,
                           [](const evidence::Record& record) {
                             EXPECT_FALSE(std::holds_alternative<evidence::PortChange>(record));
                           });
}

TEST_F(RingTest, IsBoundedByBytes) {
  recorder::Ring ring(options(1'000'000'000, 64 << 10));
  Incident incident;
  for (int i = 0; i < 2000; ++i) {
    incident.arrive("/low", 2000 + i * 10, 2001 + i * 10, Incident::Fate::accepted);
  }
  const auto recorded = dump(ring, incident);
  EXPECT_LE(ring.bytes(), 64u << 10);
  EXPECT_GT(recorded.runs.at(0).decisions.size(), 50u);
  EXPECT_EQ(recorded.runs[0].decisions.back().arrival().time, 2000 + 1999 * 10);
  evidence::Models models(compile_texts);
  EXPECT_EQ(verify(recorded, models).different, 0u);
}

}  // namespace
}  // namespace arbiter::test
