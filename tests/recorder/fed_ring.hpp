// A flight recorder's ring, and the files that it writes.
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "recorder/ring.hpp"
#include "tests/evidence/incident.hpp"
#include "tests/recorder/recording.hpp"

namespace arbiter::test {

// The ring alone, fed with an incident that was made up.
class RingTest : public testing::Test {
 protected:
  recorder::RingOptions options(evidence::Nanoseconds span, std::size_t memory) {
    recorder::RingOptions options;
    options.span = span;
    options.memory = memory;
    options.prefix = directory_.path() + "/flight";
    options.told = [this](const recorder::Dumped& dumped) {
      EXPECT_TRUE(fails_ || dumped.error.empty()) << dumped.error;
      written_.push_back(dumped.file);
      told_.push_back(dumped);
    };
    return options;
  }
  static void feed(recorder::Ring& ring, const Incident& incident) {
    for (const auto& record : incident.records()) {
      ring.write(std::make_shared<const evidence::Record>(record));
    }
  }
  // All of it, and a file.
  evidence::Recorded dump(recorder::Ring& ring, const Incident& incident) {
    feed(ring, incident);
    ring.request(recorder::Cause::signal);
    ring.finish(kEnd);
    return evidence::load_recording(written_.back());
  }

  // All that happened before `now` has come.
  static void tick(recorder::Ring& ring, evidence::Nanoseconds now) { ring.tick(now, kLater); }
  [[nodiscard]] std::size_t count_of_files() const { return files_in(directory_.path()).size(); }

  static constexpr evidence::Nanoseconds kLater = shm::kForever - 1;
  static constexpr evidence::Nanoseconds kEnd = 0;  // not known
  static constexpr evidence::Nanoseconds kSecond = 1'000'000'000;
  TemporaryDirectory directory_;
  std::vector<std::string> written_;
  std::vector<recorder::Dumped> told_;
  bool fails_ = false;
};

}  // namespace arbiter::test
