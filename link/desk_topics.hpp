// The topics on which a desk speaks with others.
#pragma once

#include <cstddef>
#include <utility>

#include "gateway/core/bridge.hpp"
#include "link/core/host_card.hpp"
#include "link/core/pulse.hpp"
#include "link/core/questions.hpp"
#include "link/core/topic_names.hpp"
#include "link/dds/message_topic.hpp"
#include "link/dds/network.hpp"

namespace arbiter::link {

inline constexpr std::size_t kMostPulseBytes = 64 + kMaxEchoes * 24;
inline constexpr std::size_t kMostQuestionBytes = 8192;
inline constexpr std::size_t kMostAnswerBytes = kMaxAnswer + 64;

struct DeskTopics {
  struct Heard {
    MessageTopic::Heard card;
    MessageTopic::Heard pulse;
    MessageTopic::Heard question;
    MessageTopic::Heard answer;
  };
  DeskTopics(const Network& network, const gateway::Bell& bell, Heard heard)
      : cards(network, kHostTopic, Delivery::kState, kMaxCardBytes, std::move(heard.card), bell),
        pulses(network, kPulseTopic, Delivery::kPulse, kMostPulseBytes, std::move(heard.pulse),
               bell),
        questions(network, kQuestionTopic, Delivery::kMessage, kMostQuestionBytes,
                  std::move(heard.question), bell),
        answers(network, kAnswerTopic, Delivery::kMessage, kMostAnswerBytes,
                std::move(heard.answer), bell) {}

  MessageTopic cards;
  MessageTopic pulses;
  MessageTopic questions;
  MessageTopic answers;
};

}  // namespace arbiter::link
