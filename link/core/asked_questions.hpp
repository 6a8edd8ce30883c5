// The questions that this link is asked: those that wait for their turn, and answers that did not
// get through.
//
// Who asks repeats a question until it is answered, or given up after OpenQuestions::kPatience. A
// question that finds no place here is as if it had not been heard: its repetition is judged anew,
// and counts in its asker's quota again. An answer that was made but could not be sent waits for
// the repetition, because a question is handled once: whoever is asked twice to switch would refuse
// the second time.
//
// Units: nanoseconds of a monotonic clock. Thread safety: none of its own.
#pragma once

#include <cstddef>
#include <deque>
#include <optional>

#include "link/core/questions.hpp"

namespace arbiter::link {

struct Asked {
  QuestionMessage message;
  bool is_ours = false;  // a program of this host asks through this link
  shm::Nanoseconds came = 0;
  std::optional<AnswerMessage> answer{};  // it was made already, and has to be sent again
};

class AskedQuestions {
 public:
  // Where as many wait, no other link's question finds a place.
  static constexpr std::size_t kMost = 64;
  // Of answers that did not get through. Where one more comes, the oldest are given up.
  static constexpr std::size_t kMostKept = 64;
  static constexpr std::size_t kMostKeptBytes = 2 * kMaxAnswer;

  // From another link's `writer`. True: there is something to do for it.
  bool hear(QuestionMessage question, std::uint64_t writer, shm::Nanoseconds now);
  // Of a program of this host, whose number is bounded elsewhere.
  void add(QuestionMessage question, shm::Nanoseconds now);

  [[nodiscard]] bool is_empty() const noexcept;
  // What is to be done next, where there is something that somebody still waits for.
  std::optional<Asked> next(shm::Nanoseconds now);
  // Of another link, with an answer, which could not be sent.
  void keep(Asked asked);

 private:
  struct Kept {
    Asked asked;
    bool is_due = false;  // its question was repeated
  };
  bool ask_again(const QuestionMessage& question);
  void forget_old(shm::Nanoseconds now);

  Askers askers_;
  std::deque<Asked> waiting_;
  std::deque<Kept> kept_;  // each has an answer
  std::size_t kept_bytes_ = 0;
};

}  // namespace arbiter::link
