// What links ask each other, are asked, promise, and know of round trips: driven by a fuzzer's
// input, beside a model of what must come of it.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "link/core/asked_questions.hpp"
#include "link/core/participant.hpp"
#include "link/core/promise.hpp"
#include "link/core/pulse.hpp"
#include "link/core/questions.hpp"
#include "tests/fuzz/fuzz.hpp"
#include "tests/fuzz/script.hpp"

namespace arbiter::fuzz {

// Up to 5.1 s further.
inline shm::Nanoseconds step(Script& script) {
  return shm::Nanoseconds{script.byte()} * shm::Nanoseconds{20'000'000};
}

class OpenQuestionSequence {
 public:
  explicit OpenQuestionSequence(Script script) : script_(script) {}

  void run() {
    while (!script_.is_at_end()) {
      now_ += step(script_);
      const std::uint8_t what = script_.byte();
      if (what % 4 == 0) ask(what);
      if (what % 4 == 1) take();
      if (what % 4 > 1) answer(what);
    }
    while (!asked_.empty()) take();
    require(open_.ask({{1, {}}}, now_) != 0, "who is done makes room");
  }

 private:
  struct Question {
    shm::Nanoseconds since = 0;
    std::map<link::Incarnation, std::set<link::Participant>> hosts;
    std::set<link::Incarnation> answered;
  };
  static link::Participant participant(std::uint8_t of) { return {of}; }

  void ask(std::uint8_t what) {
    Question question{now_, {}, {}};
    std::vector<link::OpenQuestions::Host> hosts;
    for (int i = 0; i < 1 + what / 64; ++i) {
      const std::uint8_t life = script_.byte();
      hosts.push_back({1 + life % std::uint64_t{8}, participant(life / 64)});
      question.hosts[hosts.back().life].insert(hosts.back().participant);
    }
    const std::uint64_t number = open_.ask(hosts, now_);
    require((number == 0) == (asked_.size() >= link::OpenQuestions::kMost),
            "questions are bounded in number");
    if (number == 0) return;
    require(number > last_, "numbers grow");
    last_ = number;
    asked_[number] = std::move(question);
  }
  void answer(std::uint8_t what) {
    link::AnswerMessage answer;
    answer.number = script_.number();
    answer.asker = 1;
    const std::uint8_t life = script_.byte();
    answer.answerer = 1 + life % 8;
    const link::Participant from = participant(life / 64);
    answer.text = std::string(what / 4, 'x');
    const auto question = asked_.find(answer.number);
    bool is_heard = false;
    if (question != asked_.end() && question->second.hosts.contains(answer.answerer)) {
      const auto& speakers = question->second.hosts[answer.answerer];
      const bool is_late = question->second.answered.contains(answer.answerer);
      is_heard = speakers == std::set{from} && !is_late;
    }
    const link::Incarnation by = answer.answerer;
    require(open_.note(std::move(answer), from, now_) == is_heard,
            "only who was asked is heard, once, and by its own writer");
    if (is_heard) question->second.answered.insert(by);
  }
  void take() {
    if (asked_.empty()) return;
    const auto question = asked_.begin();
    const auto& [number, what] = *question;
    const bool is_late = now_ - what.since >= link::OpenQuestions::kPatience;
    require(open_.is_over(number, now_) == (is_late || what.answered.size() == what.hosts.size()),
            "it is over once all have answered, or a second has gone by");
    const auto replies = open_.take(number);
    require(replies.size() == what.hosts.size(), "each that was asked has a reply");
    for (const auto& [life, reply] : replies) {
      const bool has_answered = reply.outcome == link::OpenQuestions::Outcome::kAnswered ||
                                reply.outcome == link::OpenQuestions::Outcome::kRefused;
      require(has_answered == what.answered.contains(life), "who has answered is known");
    }
    asked_.erase(question);
  }

  Script script_;
  link::OpenQuestions open_;
  std::map<std::uint64_t, Question> asked_;
  std::uint64_t last_ = 0;
  shm::Nanoseconds now_ = 1'000'000'000;
};

inline void drive_askers(Script script) {
  link::Askers askers;
  shm::Nanoseconds now = 10'000'000'000;
  std::map<std::uint64_t, link::Incarnation> names;  // no more than there are places for
  std::set<std::pair<std::uint64_t, std::uint64_t>> answered;
  std::map<std::uint64_t, std::vector<shm::Nanoseconds>> times;
  while (!script.is_at_end()) {
    now += shm::Nanoseconds{script.byte()} * 1'000'000;
    const std::uint64_t writer = 1 + script.byte() % 16;
    const link::Incarnation name = 1 + script.byte() % std::uint64_t{16};
    const std::uint64_t number = script.number();
    const auto verdict = askers.judge(name, writer, number, now);
    if (verdict == link::Askers::Verdict::kInAnothersName) continue;
    const auto [known, is_new] = names.try_emplace(writer, name);
    if (known->second != name) {  // another writer has had its name meanwhile, and its place
      std::erase_if(answered, [&](const auto& each) { return each.first == writer; });
      times.erase(writer);
      known->second = name;
    }
    for (auto other = names.begin(); other != names.end();) {
      const bool is_replaced = other->first != writer && other->second == name;
      if (is_replaced) {
        std::erase_if(answered, [&](const auto& each) { return each.first == other->first; });
        times.erase(other->first);
      }
      other = is_replaced ? names.erase(other) : std::next(other);
    }
    if (verdict != link::Askers::Verdict::kAnswer) continue;
    require(answered.insert({writer, number}).second, "a question is answered once");
    auto& of_it = times[writer];
    of_it.push_back(now);
    const auto recent = std::count_if(of_it.begin(), of_it.end(), [&](shm::Nanoseconds each) {
      return now - each < 1'000'000'000;
    });
    require(recent <= 2 * link::Askers::kMostOfOne, "nobody is answered too often");
  }
}

inline void drive_asked_questions(Script script) {
  link::AskedQuestions asked;
  shm::Nanoseconds now = 10'000'000'000;
  std::size_t waiting = 0;
  std::map<std::pair<link::Incarnation, std::uint64_t>, int> handled;
  while (!script.is_at_end()) {
    now += step(script) / 16;
    const std::uint8_t what = script.byte();
    if (what % 4 != 0) {
      link::QuestionMessage question;
      question.asker = 1 + what / 4 % std::uint64_t{8};
      question.number = 1 + script.byte();
      const bool is_new = asked.hear(std::move(question), 1 + what / 4 % std::uint64_t{8}, now);
      waiting += is_new ? 1 : 0;
      require(!is_new || !asked.is_empty(), "what there is to do is there");
      continue;
    }
    auto next = asked.next(now);
    require(!next || waiting != 0, "nothing is done that was not asked for");
    if (!next) {
      require(asked.is_empty(), "what is left is too old");
      waiting = 0;
      continue;
    }
    --waiting;
    require(next->answer.has_value() || now - next->came < link::OpenQuestions::kPatience,
            "nobody is answered who does not wait any more");
    int& count = handled[{next->message.asker, next->message.number}];
    if (!next->answer) {
      require(++count == 1, "a question is handled once");
      next->answer = link::AnswerMessage{9, next->message.asker, next->message.number, false,
                                         std::string(script.byte(), 'x')};
    }
    if (what % 8 == 4) asked.keep(*std::move(next));
  }
}

inline void drive_promise(Script script) {
  struct Promised {
    link::SwitchAttempt to;
    std::string model;
    shm::Nanoseconds since = 0;
  };
  link::Promise promise;
  std::optional<Promised> promised;
  std::map<link::Incarnation, std::vector<std::pair<shm::Nanoseconds, shm::Nanoseconds>>> in_vain;
  shm::Nanoseconds now = 0;
  const auto end = [&](shm::Nanoseconds when) {
    in_vain[promised->to.asker].emplace_back(promised->since, when);
    promised.reset();
  };
  while (!script.is_at_end()) {
    now += step(script);
    if (promised && now - promised->since >= link::Promise::kHolds) {
      end(promised->since + link::Promise::kHolds);
    }
    const std::uint8_t what = script.byte();
    const link::SwitchAttempt attempt{1 + what / 4 % std::uint64_t{4},
                                      1 + what / 16 % std::uint64_t{4}};
    const bool is_its_own = promised && promised->to == attempt;
    if (what % 4 == 0) {
      const auto kept = promise.keep(attempt, now);
      require(kept.has_value() == is_its_own, "who was promised a switch in time gets it");
      require(!kept || *kept == promised->model, "it is the model that was promised");
      if (kept) promised.reset();
    } else if (what % 4 == 1) {
      promise.release(attempt, now);
      if (is_its_own) end(now);
    } else {
      const auto verdict = promise.judge(attempt, now);
      require((verdict == link::Promise::Verdict::kBusy) == (promised && !is_its_own),
              "while something is promised, others are refused");
      require(verdict == link::Promise::Verdict::kFree || !is_its_own, "a promise stands");
      if (verdict == link::Promise::Verdict::kFree) {
        const std::string model(1, static_cast<char>('a' + script.byte() % 4));
        promise.promise(attempt, model, now);
        if (!promised) promised = Promised{attempt, model, now};
      }
    }
    require(promise.is_promised(now) == promised.has_value(), "one thing at a time, for 2 s");
    // What is forgotten within 10 s, and one promise more, bound what comes to nothing.
    for (const auto& [asker, times] : in_vain) {
      shm::Nanoseconds sum = 0;
      for (const auto& [from, to] : times) {
        sum += now - to < link::Promise::kWithin ? to - from : 0;
      }
      require(sum <= 4 * link::Promise::kHolds, "nobody holds up others for long");
    }
  }
}

inline void drive_round_trips(Script script) {
  link::RoundTrips me(1);
  shm::Nanoseconds now = 1'000'000'000;
  std::uint64_t sent = 0;
  std::set<link::Participant> there;
  while (!script.is_at_end()) {
    now += step(script) / 16;
    const std::uint8_t what = script.byte();
    const link::Participant from{static_cast<std::uint8_t>(what / 4)};
    if (what % 4 == 0) {
      const link::Pulse pulse = me.next(now);
      require(pulse.number == ++sent, "pulses are numbered");
      require(pulse.echoes.size() <= link::kMaxEchoes, "echoes are bounded");
    } else if (what % 4 == 1) {
      there = {from};
      me.keep(there);
    } else {
      link::Pulse pulse;
      pulse.sender = 1 + script.byte() % std::uint64_t{8};
      pulse.number = script.number();
      pulse.echoes.push_back(
          {1 + script.byte() % std::uint64_t{2}, script.number(), script.number()});
      if (what % 4 == 3) pulse.echoes.push_back({1, script.number(), script.word()});
      me.note(pulse, from, now);
    }
    const auto round_trip = me.of(from);
    require(!round_trip || (*round_trip >= 0 && *round_trip <= now),
            "a round trip is one that can be");
    const auto deaf = me.deaf();
    require(deaf.empty() || sent >= link::RoundTrips::kUnechoed,
            "who was told nothing is not deaf");
    require(deaf.size() <= link::kMaxEchoes, "who is known is bounded");
  }
  there.clear();
  me.keep(there);
  now += link::RoundTrips::kSilence;
  require(me.next(now).echoes.empty(), "who is silent is not echoed");
  require(me.deaf().empty(), "who is gone is forgotten");
}

}  // namespace arbiter::fuzz
