// What links ask each other, and the answers: messages, and what an asking link makes of it.
//
// A question goes to links, each in one of its lives (its incarnation), and has a number, which
// grows with each question of an asker. An answer is heard only if its question waits for it, from
// whom it was asked. No answer within kPatience is an outcome: the host is silent.
//
//   question  "ARBQ", version 1, incarnation of the asker, number (8), how many are asked (2),
//   their
//             incarnations (8 each); texts: the asker's host, the verb; a long text: the argument
//   answer    "ARBA", version 1, incarnation of who answers, incarnation of the asker (8), number
//             (8), 1 byte: 1 answered, 0 refused; a long text: the answer, or why not
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "link/core/cards.hpp"
#include "link/core/held_tokens.hpp"
#include "link/core/participant.hpp"

namespace arbiter::link {

inline constexpr std::size_t kMaxAsked = 256;
inline constexpr std::size_t kMaxVerb = 32;
inline constexpr std::size_t kMaxArgument = 4096;
// A status document with thousands of ports. Larger answers are refused where they are made.
inline constexpr std::size_t kMaxAnswer = std::size_t{8} << 20;

struct QuestionMessage {
  Incarnation asker = 0;
  std::uint64_t number = 0;
  std::vector<Incarnation> asked;
  std::string host;  // the asker's
  std::string verb;
  std::string argument;
};

struct AnswerMessage {
  Incarnation answerer = 0;
  Incarnation asker = 0;
  std::uint64_t number = 0;
  bool is_refusal = false;
  std::string text;
};

[[nodiscard]] ByteString write_question(const QuestionMessage& message);
[[nodiscard]] ByteString write_answer(const AnswerMessage& message);
// Nothing: it is none, or not a proper one. The text of an answer is not judged: it is a document.
[[nodiscard]] std::optional<QuestionMessage> read_question(Bytes bytes);
[[nodiscard]] std::optional<AnswerMessage> read_answer(Bytes bytes);

// The questions of this link that wait for an answer.
//
// Units: nanoseconds of a monotonic clock. Thread safety: none of its own.
class OpenQuestions {
 public:
  static constexpr shm::Nanoseconds kPatience = 1'000'000'000;
  // Until it is asked again, where nothing has come: the other link may just have been found.
  static constexpr shm::Nanoseconds kAskAgain = 250'000'000;
  static constexpr std::size_t kMost = 256;  // questions
  // Of all answers together that are not taken yet: each may be large, and hosts are many.
  static constexpr std::size_t kMostBytes = 8 * kMaxAnswer;

  enum class Outcome : std::uint8_t { kWaiting, kAnswered, kRefused, kSilent };
  // A link: which life it says it is, and whose writer has said so. Zeros: this link.
  struct Host {
    Incarnation life = 0;
    Participant participant{};
  };
  struct Reply {
    // From whom it is heard; nobody, where several say that they are this one.
    std::optional<Participant> from{};
    Outcome outcome = Outcome::kWaiting;
    shm::Nanoseconds took = 0;  // until it came
    std::string text;
  };
  using Replies = std::map<Incarnation, Reply>;

  // Its number, from 1 upwards; 0: too many wait.
  std::uint64_t ask(const std::vector<Host>& asked, shm::Nanoseconds now);
  // False: nobody waits for it, or it is another's. One that finds no room is a refusal, which says
  // so.
  bool note(AnswerMessage answer, const Participant& from, shm::Nanoseconds now);
  // Whether all have an outcome. Who has not answered for kPatience is silent from now on.
  [[nodiscard]] bool is_over(std::uint64_t number, shm::Nanoseconds now);
  // Those to be asked again now.
  [[nodiscard]] std::vector<Incarnation> due(std::uint64_t number, shm::Nanoseconds now);
  // What has become of it; it is forgotten.
  [[nodiscard]] Replies take(std::uint64_t number);

 private:
  struct Open {
    shm::Nanoseconds since = 0;
    shm::Nanoseconds ask_again = 0;
    Replies replies;
  };
  std::map<std::uint64_t, Open> open_;
  std::size_t bytes_ = 0;  // of the texts in open_
  std::uint64_t last_ = 0;
};

// Those who ask this link: each question is answered once, and not too many in a second.
//
// Askers are strangers: each has a quota, all together have one, and their number is bounded. An
// asker is a writer: it has the first name that it uses, and no other, so its quota does not grow
// with the names that it makes up. Nobody else has that name, until its writer has been silent for
// kOtherWriter: a link that was cut off comes back in the same life, and the transport takes its
// writer for another one (held_tokens.hpp).
//
// Thread safety: none of its own.
class Askers {
 public:
  static constexpr std::uint32_t kMostOfOne = 20;   // questions within a second
  static constexpr std::uint32_t kMostOfAll = 200;  // likewise
  static constexpr std::size_t kMostAskers = 256;
  // What is known of an asker's numbers: what lies further back counts as answered.
  static constexpr std::uint64_t kKnownNumbers = 64;
  static constexpr shm::Nanoseconds kOtherWriter = HeldTokens::kOtherWriter;

  enum class Verdict : std::uint8_t {
    kAnswer,
    kRepeated,  // it is answered already, or is being answered
    kTooMany,
    kInAnothersName,
  };
  // `asker`: one of its lives. `writer`: by which the transport knows who sent it.
  Verdict judge(Incarnation asker, std::uint64_t writer, std::uint64_t number,
                shm::Nanoseconds now);
  // What was to be answered is not: it may come again. The quota stays used.
  void forget(std::uint64_t writer, std::uint64_t number);

 private:
  // Those that were taken up.
  class Numbers {
   public:
    [[nodiscard]] bool have(std::uint64_t number) const noexcept;
    void add(std::uint64_t number) noexcept;
    void remove(std::uint64_t number) noexcept;

   private:
    std::uint64_t last_ = 0;
    std::uint64_t known_ = 0;  // bit n: whether last_ - n is among them
  };
  struct Asker {
    Incarnation name = 0;
    Numbers numbers;
    shm::Nanoseconds since = 0;  // of the second that is counted
    std::uint32_t count = 0;
    shm::Nanoseconds heard = 0;
  };
  bool may_be_called(Incarnation name, std::uint64_t writer, shm::Nanoseconds now);
  void make_place();

  std::map<std::uint64_t, Asker> askers_;  // by their writers
  shm::Nanoseconds since_ = 0;
  std::uint32_t count_ = 0;
};

}  // namespace arbiter::link
