// Rule 9 of docs/hosts.md: an answer is heard only from the link that was asked. All that are on
// the network hear what is asked, and know all that the answer says.
#include <gtest/gtest.h>

#include <mutex>
#include <vector>

#include "link/core/questions.hpp"
#include "link/core/topic_names.hpp"
#include "link/dds/message_topic.hpp"
#include "link/dds/network.hpp"
#include "tests/link/known_hosts.hpp"

namespace arbiter::test {
namespace {

// Answers each question that it hears in the name of all that are asked.
class Forger {
 public:
  explicit Forger(const link::Network& network)
      : answers_(
            network, link::kAnswerTopic, link::Delivery::kMessage, 100,
            [](Bytes, const gateway::dds::SampleWriter&) {}, bell_),
        questions_(
            network, link::kQuestionTopic, link::Delivery::kMessage, 8192,
            [this](Bytes bytes, const gateway::dds::SampleWriter&) { forge(bytes); }, bell_) {}

  [[nodiscard]] int forged() const {
    const std::lock_guard lock(mutex_);
    return forged_;
  }

 private:
  void forge(Bytes bytes) {
    const auto question = link::read_question(bytes);
    ASSERT_TRUE(question);
    for (const link::Incarnation asked : question->asked) {
      const bool is_sent = answers_.send(
          link::write_answer({asked, question->asker, question->number, false, "forged"}));
      const std::lock_guard lock(mutex_);
      forged_ += is_sent ? 1 : 0;
    }
  }

  const gateway::Bell bell_;
  mutable std::mutex mutex_;
  int forged_ = 0;
  link::MessageTopic answers_;
  link::MessageTopic questions_;
};

class ForgedAnswers : public LoopbackHosts {};

// The one that is asked is stopped, so nobody answers before the forger does.
TEST_F(ForgedAnswers, AreNotHeard) {
  Host base("base", runtime_, kNoRules, network());
  Host cam("cam", runtime_, kNoRules, network());
  const link::Network outside({domain_.number(), {}, {}});
  const Forger forger(outside);
  await([&] {
    await_host("base", "cam");
    const int before = forger.forged();
    cam.link().signal(SIGSTOP);
    const auto answers = wire::LinkCall("base").ask_hosts({"cam", "model"});
    cam.link().signal(SIGCONT);
    EXPECT_EQ(answers.size(), 1U);
    EXPECT_NE(answers.at(0).text, "forged");
    // On a busy machine it may be gone before it is asked.
    return (answers.at(0).outcome == wire::HostOutcome::kSilent && forger.forged() > before) ||
           HasFailure();
  });
}

}  // namespace
}  // namespace arbiter::test
