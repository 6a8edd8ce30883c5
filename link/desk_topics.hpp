// The topics on which a desk speaks with others; of desk.cpp and desk_questions.cpp.
#pragma once

#include <cstdint>

#include "gateway/core/bridge.hpp"
#include "link/core/pulse.hpp"
#include "link/core/questions.hpp"
#include "link/core/topic_names.hpp"
#include "link/dds/message_topic.hpp"
#include "link/dds/network.hpp"
#include "link/desk.hpp"

namespace arbiter::link {

inline constexpr std::size_t kMostPulseBytes = 64 + kMaxEchoes * 24;
inline constexpr std::size_t kMostQuestionBytes = 8192;
inline constexpr std::size_t kMostAnswerBytes = kMaxAnswer + 64;

struct Desk::Topics {
  using Writer = gateway::dds::SampleWriter;
  Topics(Desk& desk, const Network& network, const gateway::Bell& bell)
      : cards(
            network, kHostTopic, Delivery::kState, kMaxCardBytes,
            [&desk](Bytes bytes, const Writer& writer) { desk.hear_card(bytes, writer); }, bell),
        pulses(
            network, kPulseTopic, Delivery::kPulse, kMostPulseBytes,
            [&desk](Bytes bytes, const Writer& writer) {
              desk.hear_pulse(bytes, writer.participant);
            },
            bell),
        questions(
            network, kQuestionTopic, Delivery::kMessage, kMostQuestionBytes,
            [&desk](Bytes bytes, const Writer& writer) {
              desk.hear_question(bytes, writer.handle);
            },
            bell),
        answers(
            network, kAnswerTopic, Delivery::kMessage, kMostAnswerBytes,
            [&desk](Bytes bytes, const Writer& writer) {
              desk.hear_answer(bytes, writer.participant);
            },
            bell) {}

  MessageTopic cards;
  MessageTopic pulses;
  MessageTopic questions;
  MessageTopic answers;
};

}  // namespace arbiter::link
