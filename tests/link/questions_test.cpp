// What links ask each other, by injected time: link/core/questions.hpp, asked_questions.hpp. Rule 8
// of docs/hosts.md: who has not answered within 1 s is silent. Rule 9: 20 answers a second to one
// link, 200 to all.
#include "link/core/questions.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "link/core/asked_questions.hpp"
#include "tests/link/messages_and_times.hpp"

namespace arbiter::test {
namespace {

using namespace link;
using testing::ElementsAre;
using testing::IsEmpty;

static_assert(OpenQuestions::kPatience == kS, "rule 8 says so");
static_assert(Askers::kMostOfOne == 20 && Askers::kMostOfAll == 200, "rule 9 says so");

TEST(QuestionMessages, AreReadAsTheyWereWritten) {
  const QuestionMessage question{5, 9, {6, 7}, "head", "status", "all of it"};
  const auto read = read_question(as_bytes(write_question(question)));
  ASSERT_TRUE(read);
  EXPECT_EQ(read->asker, 5U);
  EXPECT_EQ(read->number, 9U);
  EXPECT_THAT(read->asked, ElementsAre(6U, 7U));
  EXPECT_EQ(read->host, "head");
  EXPECT_EQ(read->verb, "status");
  EXPECT_EQ(read->argument, "all of it");
  const AnswerMessage answer{6, 5, 9, true, std::string(100'000, 'x')};
  const auto given = read_answer(as_bytes(write_answer(answer)));
  ASSERT_TRUE(given);
  EXPECT_TRUE(given->is_refusal);
  EXPECT_EQ(given->text, answer.text);
}

TEST(QuestionMessages, AreRefusedWhereTheyExceedTheirBounds) {
  const auto is_read = [](QuestionMessage question) {
    return read_question(as_bytes(write_question(question))).has_value();
  };
  EXPECT_TRUE(is_read({5, 9, {6}, "head", "status", {}}));
  EXPECT_FALSE(is_read({0, 9, {6}, "head", "status", {}}));
  EXPECT_FALSE(is_read({5, 0, {6}, "head", "status", {}}));
  EXPECT_FALSE(is_read({5, 9, {}, "head", "status", {}}));
  EXPECT_FALSE(is_read({5, 9, {6}, "he/ad", "status", {}}));
  EXPECT_FALSE(is_read({5, 9, {6}, "head", "Status", {}}));
  EXPECT_FALSE(is_read({5, 9, {6}, "head", std::string(kMaxVerb + 1, 'x'), {}}));
  EXPECT_FALSE(is_read({5, 9, {6}, "head", "status", std::string(kMaxArgument + 1, 'x')}));
  EXPECT_FALSE(is_read({5, 9, std::vector<Incarnation>(kMaxAsked + 1, 6), "head", "status", {}}));
}

OpenQuestions::Host six() { return {6, participant(6)}; }
OpenQuestions::Host seven() { return {7, participant(7)}; }

TEST(OpenQuestion, IsSilentAfterASecond) {
  OpenQuestions open;
  const auto number = open.ask({six(), seven()}, kS);
  EXPECT_TRUE(open.note({6, 5, number, false, "here"}, participant(6), kS + 3 * kMs));
  EXPECT_FALSE(open.is_over(number, kS + OpenQuestions::kPatience - 1));
  EXPECT_TRUE(open.is_over(number, kS + OpenQuestions::kPatience));
  const auto replies = open.take(number);
  EXPECT_EQ(replies.at(6).outcome, OpenQuestions::Outcome::kAnswered);
  EXPECT_EQ(replies.at(6).took, 3 * kMs);
  EXPECT_EQ(replies.at(6).text, "here");
  EXPECT_EQ(replies.at(7).outcome, OpenQuestions::Outcome::kSilent);
}

TEST(OpenQuestion, HearsOnlyWhoWasAskedAndOnce) {
  OpenQuestions open;
  const auto number = open.ask({six()}, kS);
  EXPECT_FALSE(open.note({8, 5, number, false, "a stranger"}, participant(8), kS));
  EXPECT_FALSE(open.note({6, 5, number + 1, false, "another question"}, participant(6), kS));
  EXPECT_TRUE(open.note({6, 5, number, true, "no"}, participant(6), kS));
  EXPECT_FALSE(open.note({6, 5, number, false, "yes after all"}, participant(6), kS));
  EXPECT_TRUE(open.is_over(number, kS));
  EXPECT_EQ(open.take(number).at(6).outcome, OpenQuestions::Outcome::kRefused);
  EXPECT_FALSE(open.note({6, 5, number, false, "late"}, participant(6), kS))
      << "nobody waits any more";
}

// Everybody hears the question, and could answer it first.
TEST(OpenQuestion, HearsNobodyInTheNameOfAnother) {
  OpenQuestions open;
  const auto number = open.ask({six(), seven()}, kS);
  EXPECT_FALSE(open.note({6, 5, number, false, "prepared"}, participant(7), kS));
  EXPECT_FALSE(open.note({6, 5, number, false, "prepared"}, participant(8), kS));
  EXPECT_TRUE(open.note({6, 5, number, true, "no"}, participant(6), kS));
  EXPECT_EQ(open.take(number).at(6).outcome, OpenQuestions::Outcome::kRefused);
}

TEST(OpenQuestion, HearsNobodyWhereSeveralSayThatTheyAreTheOne) {
  OpenQuestions open;
  const auto number = open.ask({six(), {6, participant(8)}, six()}, kS);
  for (const auto& each : {participant(6), participant(8), participant(0)}) {
    EXPECT_FALSE(open.note({6, 5, number, false, "prepared"}, each, kS));
  }
  EXPECT_TRUE(open.is_over(number, kS + OpenQuestions::kPatience));
  EXPECT_EQ(open.take(number).at(6).outcome, OpenQuestions::Outcome::kSilent);
}

TEST(OpenQuestion, IsAskedAgainUntilItIsAnswered) {
  OpenQuestions open;
  const auto number = open.ask({six(), seven()}, kS);
  EXPECT_THAT(open.due(number, kS + OpenQuestions::kAskAgain - 1), IsEmpty());
  open.note({7, 5, number, false, "here"}, participant(7), kS);
  EXPECT_THAT(open.due(number, kS + OpenQuestions::kAskAgain), ElementsAre(6U));
  EXPECT_THAT(open.due(number, kS + OpenQuestions::kAskAgain + 1), IsEmpty());
  EXPECT_THAT(open.due(number, kS + 2 * OpenQuestions::kAskAgain), ElementsAre(6U));
}

TEST(OpenQuestion, WaitsInBoundedNumber) {
  OpenQuestions open;
  for (std::size_t i = 0; i < OpenQuestions::kMost; ++i) EXPECT_NE(open.ask({six()}, kS), 0U);
  EXPECT_EQ(open.ask({six()}, kS), 0U);
  static_cast<void>(open.take(1));
  EXPECT_NE(open.ask({six()}, kS), 0U);
}

TEST(OpenQuestion, KeepsABoundedNumberOfBytesOfAllAnswersTogether) {
  OpenQuestions open;
  const std::size_t most = OpenQuestions::kMostBytes / kMaxAnswer;
  std::vector<OpenQuestions::Host> asked;
  for (Incarnation each = 1; each <= most + 1; ++each) asked.push_back({each, {}});
  const auto number = open.ask(asked, kS);
  const std::string large(kMaxAnswer, 'x');
  for (const auto& each : asked) {
    EXPECT_TRUE(open.note({each.life, 5, number, false, large}, {}, kS));
  }
  const auto replies = open.take(number);
  EXPECT_EQ(replies.at(most).outcome, OpenQuestions::Outcome::kAnswered);
  EXPECT_EQ(replies.at(most + 1).outcome, OpenQuestions::Outcome::kRefused);
  const auto next = open.ask({six()}, kS);
  EXPECT_TRUE(open.note({6, 5, next, false, large}, participant(6), kS));
  EXPECT_EQ(open.take(next).at(6).outcome, OpenQuestions::Outcome::kAnswered);
}

TEST(AskingLinks, AreAnsweredOnceAndNotTooOften) {
  using Verdict = Askers::Verdict;
  Askers askers;
  EXPECT_EQ(askers.judge(5, 5, 1, 10 * kS), Verdict::kAnswer);
  EXPECT_EQ(askers.judge(5, 5, 1, 10 * kS), Verdict::kRepeated);
  for (std::uint64_t number = 2; number <= Askers::kMostOfOne; ++number) {
    EXPECT_EQ(askers.judge(5, 5, number, 10 * kS), Verdict::kAnswer);
  }
  EXPECT_EQ(askers.judge(5, 5, 100, 10 * kS), Verdict::kTooMany);
  EXPECT_EQ(askers.judge(6, 6, 1, 10 * kS), Verdict::kAnswer) << "another one";
  EXPECT_EQ(askers.judge(5, 5, 100, 11 * kS), Verdict::kAnswer)
      << "what was not answered may come again";
  EXPECT_EQ(askers.judge(5, 5, 100, 12 * kS), Verdict::kRepeated);
}

// Several programs of a host ask at once: of two questions, the first may find no place, and the
// second one.
TEST(AskingLinks, AreAnsweredWhatWasNotYetAlsoAfterALaterQuestion) {
  using Verdict = Askers::Verdict;
  Askers askers;
  EXPECT_EQ(askers.judge(5, 5, 100, 10 * kS), Verdict::kAnswer);
  EXPECT_EQ(askers.judge(5, 5, 99, 10 * kS), Verdict::kAnswer);
  EXPECT_EQ(askers.judge(5, 5, 99, 10 * kS), Verdict::kRepeated);
  EXPECT_EQ(askers.judge(5, 5, 100, 10 * kS), Verdict::kRepeated);
  askers.forget(5, 99);
  EXPECT_EQ(askers.judge(5, 5, 100, 10 * kS), Verdict::kRepeated);
  EXPECT_EQ(askers.judge(5, 5, 99, 10 * kS), Verdict::kAnswer);
  EXPECT_EQ(askers.judge(5, 5, 100 - Askers::kKnownNumbers, 10 * kS), Verdict::kRepeated)
      << "nobody knows any more";
  EXPECT_EQ(askers.judge(5, 5, 1000, 11 * kS), Verdict::kAnswer);
  EXPECT_EQ(askers.judge(5, 5, 99, 11 * kS), Verdict::kRepeated) << "likewise";
}

TEST(AskingLinks, HaveNoMoreQuestionsForBeingForgotten) {
  using Verdict = Askers::Verdict;
  Askers askers;
  for (std::uint32_t i = 0; i < Askers::kMostOfOne; ++i) {
    EXPECT_EQ(askers.judge(5, 5, 1, 10 * kS), Verdict::kAnswer);
    askers.forget(5, 1);
  }
  EXPECT_EQ(askers.judge(5, 5, 1, 10 * kS), Verdict::kTooMany);
}

// Each name would have a quota of its own.
TEST(AskingLinks, HaveOneNameEach) {
  using Verdict = Askers::Verdict;
  Askers askers;
  EXPECT_EQ(askers.judge(5, 66, 1, 10 * kS), Verdict::kAnswer);
  EXPECT_EQ(askers.judge(6, 66, 2, 10 * kS), Verdict::kInAnothersName);
  EXPECT_EQ(askers.judge(6, 67, 1, 10 * kS), Verdict::kAnswer) << "whose it is";
  EXPECT_EQ(askers.judge(5, 66, 2, 11 * kS), Verdict::kAnswer);
}

TEST(AskingLinks, AllTogetherHaveAQuota) {
  Askers askers;
  std::uint32_t answered = 0;
  for (Incarnation asker = 1; asker <= 1000; ++asker) {
    if (askers.judge(asker, asker, 1, 10 * kS) == Askers::Verdict::kAnswer) ++answered;
  }
  EXPECT_EQ(answered, Askers::kMostOfAll);
  EXPECT_EQ(askers.judge(2000, 2000, 1, 11 * kS), Askers::Verdict::kAnswer);
}

TEST(AskingLinks, NobodyAsksInAnothersName) {
  Askers askers;
  using Verdict = Askers::Verdict;
  EXPECT_EQ(askers.judge(5, 50, 1, 10 * kS), Verdict::kAnswer);
  EXPECT_EQ(askers.judge(5, 66, 1000, 10 * kS), Verdict::kInAnothersName);
  EXPECT_EQ(askers.judge(5, 50, 2, 11 * kS), Verdict::kAnswer) << "it is heard all the same";
  EXPECT_EQ(askers.judge(5, 50, 2, 12 * kS), Verdict::kRepeated);
  EXPECT_EQ(askers.judge(5, 66, 1, 13 * kS), Verdict::kInAnothersName) << "it has just repeated it";
  EXPECT_EQ(askers.judge(5, 66, 1, 12 * kS + Askers::kOtherWriter), Verdict::kAnswer);
}

// The transport has lost its writer after a lease, and found it again as another one.
TEST(AskingLinks, ALinkThatWasCutOffIsAnsweredAsSoonAsItIsFoundAgain) {
  constexpr shm::Nanoseconds kLease = 1'500'000'000;  // dds/network.cpp
  Askers askers;
  using Verdict = Askers::Verdict;
  EXPECT_EQ(askers.judge(5, 50, 7, 10 * kS), Verdict::kAnswer);
  EXPECT_EQ(askers.judge(5, 51, 8, 10 * kS + kLease), Verdict::kAnswer);
  EXPECT_EQ(askers.judge(5, 50, 9, 10 * kS + kLease), Verdict::kInAnothersName)
      << "the name is the new writer's";
}

QuestionMessage question_of(Incarnation asker, std::uint64_t number) {
  return {asker, number, {1}, "head", "commit", {}};
}

AnswerMessage answer_to(const Asked& asked, std::size_t size = 1) {
  return {1, asked.message.asker, asked.message.number, false, std::string(size, 'x')};
}

// An asker has 20 a second, and all together more than find a place.
std::size_t fill(AskedQuestions& asked) {
  std::size_t count = 0;
  for (Incarnation asker = 100; count < AskedQuestions::kMost; ++asker) {
    for (std::uint64_t number = 1; number <= 10 && count < AskedQuestions::kMost; ++number) {
      count += asked.hear(question_of(asker, number), asker, 10 * kS) ? 1 : 0;
    }
  }
  return count;
}

TEST(AskedQuestion, ThatFoundNoPlaceIsAnsweredWhenItIsRepeated) {
  AskedQuestions asked;
  ASSERT_EQ(fill(asked), AskedQuestions::kMost);
  EXPECT_FALSE(asked.hear(question_of(5, 1), 5, 10 * kS));
  ASSERT_TRUE(asked.next(10 * kS));
  EXPECT_TRUE(asked.hear(question_of(5, 1), 5, 10 * kS)) << "a place has become free";
  EXPECT_FALSE(asked.hear(question_of(5, 1), 5, 10 * kS)) << "it has one";
  std::size_t found = 0;
  while (const auto next = asked.next(10 * kS)) found += next->message.asker == 5 ? 1 : 0;
  EXPECT_EQ(found, 1U);
  EXPECT_TRUE(asked.is_empty());
  EXPECT_FALSE(asked.hear(question_of(5, 1), 5, 10 * kS)) << "it is being answered";
}

TEST(AskedQuestion, IsNotAnsweredOnceNobodyWaits) {
  AskedQuestions asked;
  ASSERT_TRUE(asked.hear(question_of(5, 1), 5, 10 * kS));
  asked.add(question_of(1, 1), 11 * kS);
  const auto next = asked.next(10 * kS + OpenQuestions::kPatience);
  ASSERT_TRUE(next);
  EXPECT_TRUE(next->is_ours);
  EXPECT_TRUE(asked.is_empty());
}

// To ask again would be to switch twice.
TEST(AskedQuestion, WhoseAnswerDidNotGetThroughIsAnsweredTheSameWhenItIsRepeated) {
  AskedQuestions asked;
  ASSERT_TRUE(asked.hear(question_of(5, 1), 5, 10 * kS));
  auto next = asked.next(10 * kS);
  ASSERT_TRUE(next);
  EXPECT_FALSE(next->answer);
  next->answer = answer_to(*next, 7);
  asked.keep(*std::move(next));
  EXPECT_TRUE(asked.is_empty()) << "it is not repeated yet";
  EXPECT_FALSE(asked.hear(question_of(5, 1), 66, 10 * kS)) << "by a stranger";
  EXPECT_TRUE(asked.hear(question_of(5, 1), 5, 10 * kS));
  EXPECT_FALSE(asked.hear(question_of(5, 1), 5, 10 * kS)) << "once is enough";
  const auto again = asked.next(10 * kS);
  ASSERT_TRUE(again);
  ASSERT_TRUE(again->answer);
  EXPECT_EQ(again->answer->text.size(), 7U);
  EXPECT_FALSE(asked.next(10 * kS));
  EXPECT_FALSE(asked.hear(question_of(5, 1), 5, 10 * kS)) << "it is sent";
}

TEST(AskedQuestion, WhoseAnswerDidNotGetThroughIsForgottenWhenNobodyWaits) {
  AskedQuestions asked;
  ASSERT_TRUE(asked.hear(question_of(5, 1), 5, 10 * kS));
  auto next = asked.next(10 * kS);
  ASSERT_TRUE(next);
  next->answer = answer_to(*next);
  asked.keep(*std::move(next));
  EXPECT_TRUE(asked.hear(question_of(5, 1), 5, 10 * kS));
  EXPECT_FALSE(asked.next(10 * kS + OpenQuestions::kPatience));
  EXPECT_TRUE(asked.is_empty());
}

TEST(AskedQuestion, OfWhichAnswersAreKeptInBoundedNumberAndSize) {
  AskedQuestions asked;
  const auto keep = [&](std::uint64_t number, std::size_t size) {
    ASSERT_TRUE(asked.hear(question_of(5, number), 5, 10 * kS));
    auto next = asked.next(10 * kS);
    ASSERT_TRUE(next);
    next->answer = answer_to(*next, size);
    asked.keep(*std::move(next));
  };
  for (std::uint64_t number = 1; number <= 3; ++number) keep(number, kMaxAnswer);
  EXPECT_FALSE(asked.hear(question_of(5, 1), 5, 10 * kS)) << "the first made room";
  EXPECT_TRUE(asked.hear(question_of(5, 2), 5, 10 * kS));
  EXPECT_TRUE(asked.hear(question_of(5, 3), 5, 10 * kS));
  EXPECT_EQ(asked.next(10 * kS)->message.number, 2U);
  EXPECT_EQ(asked.next(10 * kS)->message.number, 3U);
  for (std::uint64_t number = 4; number <= 5; ++number) keep(number, kMaxAnswer);
  EXPECT_TRUE(asked.hear(question_of(5, 4), 5, 10 * kS)) << "there was room for both";
}

}  // namespace
}  // namespace arbiter::test
