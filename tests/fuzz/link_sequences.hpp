// What keeps the order of what other hosts' links send, and the lists of those hosts: driven by a
// fuzzer's input, beside a model of what must come of it.
#pragma once

#include <algorithm>
#include <array>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "link/core/held_tokens.hpp"
#include "link/core/neighbours.hpp"
#include "link/core/speaker.hpp"
#include "link/core/stream.hpp"
#include "tests/fuzz/fuzz.hpp"
#include "tests/fuzz/question_sequences.hpp"
#include "tests/fuzz/script.hpp"

namespace arbiter::fuzz {

// As many exporters as a stream remembers, so that none begins again.
class StreamSequence {
 public:
  explicit StreamSequence(Script script) : script_(script) {}

  void run() {
    // Without sequences of publishers, all that is missed is numbers.
    has_sequences_ = script_.byte() % 2 != 0;
    while (!script_.is_at_end()) {
      const std::uint8_t what = script_.byte();
      const std::uint64_t from = 1 + script_.byte() % exporters_.size();
      if (what % 8 == 0) pause();
      if (what % 8 == 1) obey(from);
      if (what % 8 == 2) complete(from);
      if (what % 8 > 2) note(from, what);
      require(obeyed_ == 0 || stream_.is_deactivated() == of(obeyed_).is_deactivated,
              "the last event of who is obeyed tells the state");
    }
  }

 private:
  struct Exporter {
    std::uint64_t last = 0;
    bool is_deactivated = false;
    bool is_awaited = false;
  };
  Exporter& of(std::uint64_t exporter) { return exporters_.at(exporter - 1); }

  void pause() {
    stream_.pause();
    has_begun_ = false;
  }
  void obey(std::uint64_t exporter) {
    stream_.obey(exporter);
    if (obeyed_ != exporter) has_begun_ = false;
    obeyed_ = exporter;
  }
  void complete(std::uint64_t from) {
    const std::uint64_t number = script_.number();
    Exporter& exporter = of(from);
    const bool completes = obeyed_ == from && exporter.last == number && exporter.is_awaited;
    require(stream_.completes(from, number) == completes, "a sample that was awaited comes once");
    if (completes) exporter.is_awaited = false;
  }
  void note(std::uint64_t from, std::uint8_t what) {
    link::StreamEvent event;
    event.number = what % 2 == 0 ? of(from).last + script_.byte() : script_.number();
    event.sequence = has_sequences_ ? script_.number() : 0;
    event.has_sample = (what & 8) != 0;
    event.is_deactivated = (what & 16) != 0;
    event.is_withheld = (what & 32) != 0;
    event.is_unasked = (what & 64) != 0;
    const std::uint64_t lost = stream_.lost();
    const std::uint64_t doubled = stream_.doubled();
    if (obeyed_ != from) has_begun_ = false;
    obeyed_ = from;
    Exporter& exporter = of(from);
    const bool is_new = event.number > exporter.last;
    require(stream_.note(from, event) == is_new, "the order never goes back, and nothing is twice");
    require(stream_.doubled() == doubled + (is_new ? 0 : 1), "what is twice is counted");
    const std::uint64_t skipped = is_new && has_begun_ ? event.number - exporter.last - 1 : 0;
    require(stream_.lost() >= lost, "a counter only grows");
    const std::uint64_t counted = std::min(skipped, ~lost);  // it never begins again
    require(has_sequences_ ? stream_.lost() - lost >= counted : stream_.lost() - lost == counted,
            "losses are the numbers that were skipped");
    if (!is_new) return;
    has_begun_ = has_begun_ || !event.is_unasked;
    exporter.last = event.number;
    exporter.is_deactivated = event.is_deactivated;
    if (event.has_sample || event.is_deactivated) exporter.is_awaited = event.is_withheld;
  }

  Script script_;
  link::Stream stream_;
  std::array<Exporter, 8> exporters_{};
  std::uint64_t obeyed_ = 0;
  bool has_sequences_ = false;
  bool has_begun_ = false;
};

inline void drive_speaker(Script script) {
  link::Speaker speaker;
  std::map<std::uint64_t, std::string> offerers;
  while (!script.is_at_end()) {
    const bool adds = script.byte() % 3 != 0;
    const std::uint64_t key = 1 + script.byte() % 16;
    const link::Offerer* const before = speaker.current();
    const std::uint64_t key_before = before == nullptr ? 0 : before->key;
    const std::string host_before = before == nullptr ? "" : before->host;
    if (adds) {
      const std::string host(1, static_cast<char>('a' + script.byte() % 4));
      speaker.add({key, host, 1 + script.byte() % std::uint64_t{4}});
      offerers.try_emplace(key, host);
      const bool may_change = key_before == 0 || host == host_before;
      require(may_change || speaker.current()->key == key_before, "a further host waits");
    } else {
      speaker.remove(key);
      offerers.erase(key);
      require(key == key_before || key_before == 0 || speaker.current()->key == key_before,
              "who is obeyed stays so until it is gone");
    }
    const link::Offerer* const now = speaker.current();
    require((now == nullptr) == offerers.empty(), "somebody is obeyed where anybody offers");
    require(now == nullptr || offerers.at(now->key) == now->host, "it is one that offers");
    std::set<std::string> hosts;
    for (const auto& [of, host] : offerers) hosts.insert(host);
    require(speaker.hosts() == std::vector<std::string>(hosts.begin(), hosts.end()),
            "hosts are named once and in order");
  }
}

// No more importers than there are places for: so none gives way, and each note can be foretold.
inline void drive_held_tokens(Script script) {
  struct Known {
    std::uint64_t writer = 0;
    std::uint64_t last = 0;
    shm::Nanoseconds heard = 0;
  };
  link::HeldTokens held;
  std::map<link::Incarnation, Known> known;
  shm::Nanoseconds now = 0;
  std::vector<link::NamedToken> named;
  while (!script.is_at_end()) {
    now += shm::Nanoseconds{script.byte()} * 20'000'000;
    const link::Incarnation importer = 1 + script.byte() % link::kMaxImporters;
    const std::uint64_t writer = 1 + script.byte() % 100;
    const std::uint64_t number = script.number();
    const auto found = known.find(importer);
    const bool is_its_own = found != known.end() && found->second.writer == writer;
    const bool is_anothers = found != known.end() && !is_its_own &&
                             now - found->second.heard < link::HeldTokens::kOtherWriter;
    const bool has_other_name =
        !is_its_own && std::any_of(known.begin(), known.end(),
                                   [&](const auto& each) { return each.second.writer == writer; });
    const bool is_heard = !is_anothers && !has_other_name;
    require(held.note(importer, number, writer, now) == is_heard,
            "a writer speaks for one importer, and nobody else does");
    if (is_heard) {
      Known& one = known[importer];
      // Another writer's numbers count, even where they are lower than those before.
      one = {writer, is_its_own ? std::max(one.last, number) : number, now};
    }
    held.name(now, named);
    require(named.size() <= known.size(), "nobody is named who was not heard");
    for (const link::NamedToken& each : named) {
      require(each.number == known.at(each.importer).last, "the newest token is named");
    }
  }
}

// More importers than places, each by a writer of its own.
inline void crowd_held_tokens(Script script) {
  link::HeldTokens held;
  shm::Nanoseconds now = 0;
  std::vector<link::NamedToken> named;
  while (!script.is_at_end()) {
    now += shm::Nanoseconds{script.byte()} * 100'000'000;
    const std::uint64_t importer = 1 + script.byte();
    static_cast<void>(held.note(importer, 1 + script.byte(), importer, now));
    held.name(now, named);
    require(named.size() <= link::kMaxImporters, "importers are bounded");
  }
}

class NeighbourSequence {
 public:
  explicit NeighbourSequence(Script script) : script_(script) {}

  void run() {
    while (!script_.is_at_end()) {
      now_ += 1 + shm::Nanoseconds{script_.byte()} * 1'000'000'000;
      const std::uint8_t what = script_.byte();
      if (what % 4 == 0) {
        keep(what);
      } else {
        const bool is_crowd = what % 4 == 1 && crowds_ < kMostCrowds;
        crowds_ += is_crowd ? 1 : 0;
        const std::size_t count = is_crowd ? 64 : 1;
        const std::uint64_t first = 1 + 2 * std::uint64_t{script_.byte()};
        for (std::uint64_t key = first; key < first + count; ++key) note(key, what);
      }
      check();
    }
    now_ += link::Neighbours::kRemembered + 1;
    neighbours_.keep({}, now_);
    neighbours_.keep({}, now_ + link::Neighbours::kRemembered);
    require(neighbours_.all().empty() && neighbours_.without_place() == 0,
            "who has been gone for long is forgotten");
  }

 private:
  void note(std::uint64_t key, std::uint8_t what) {
    link::HostCard card;
    card.host = "host" + std::to_string((what & 4) != 0 ? key % 8 : key);
    card.incarnation = 1 + what;
    const bool has_place = neighbours_.note(key, card, now_);
    const auto& all = neighbours_.all();
    const bool is_there = std::any_of(all.begin(), all.end(), [&](const link::Neighbour& each) {
      return each.is_up && each.key == key && each.card->host == card.host;
    });
    require(is_there == has_place, "who has a place is listed");
    require(has_place || neighbours_.without_place() != 0, "who has none is counted");
  }
  void keep(std::uint8_t what) {
    std::vector<std::uint64_t> keys;
    for (const link::Neighbour& each : neighbours_.all()) {
      if (each.is_up && (each.key * 7 + what) % 5 != 0) keys.push_back(each.key);
    }
    neighbours_.keep(keys, now_);
    for (const link::Neighbour& each : neighbours_.all()) {
      const bool is_kept = std::find(keys.begin(), keys.end(), each.key) != keys.end();
      require(each.is_up == is_kept, "who is there no longer is gone");
    }
  }
  void check() const {
    const auto& all = neighbours_.all();
    require(all.size() <= link::Neighbours::kMost, "hosts are bounded");
    require(neighbours_.without_place() <= 2 * link::Neighbours::kMostWithoutPlace,
            "those without a place are bounded");
    std::set<std::uint64_t> keys;
    for (std::size_t i = 0; i < all.size(); ++i) {
      require(!all[i].is_up || keys.insert(all[i].key).second, "a writer is one host");
      if (i == 0 || all[i - 1].is_up != all[i].is_up) {
        require(i == 0 || all[i - 1].is_up, "those that are there come first");
        continue;
      }
      require(all[i - 1].card->host <= all[i].card->host, "hosts are in the order of their names");
    }
  }

  // More than there are places for; each takes its time.
  static constexpr int kMostCrowds = 6;

  Script script_;
  link::Neighbours neighbours_;
  shm::Nanoseconds now_ = 0;
  int crowds_ = 0;
};

// The first byte says which: all of them for each input would leave time for few inputs.
inline void check_sequences(const std::uint8_t* data, std::size_t size) {
  constexpr std::size_t kMost = 512;  // longer ones show nothing new, and take their time
  if (size == 0) return;
  const Script script(data + 1, std::min(size - 1, kMost));
  switch (data[0] % 10) {
    case 0:
      return StreamSequence(script).run();
    case 1:
      return drive_speaker(script);
    case 2:
      return drive_held_tokens(script);
    case 3:
      return crowd_held_tokens(script);
    case 4:
      return NeighbourSequence(script).run();
    case 5:
      return OpenQuestionSequence(script).run();
    case 6:
      return drive_askers(script);
    case 7:
      return drive_asked_questions(script);
    case 8:
      return drive_promise(script);
    default:
      return drive_round_trips(script);
  }
}

}  // namespace arbiter::fuzz
