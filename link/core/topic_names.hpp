// What the topic of a source is called. DDS takes letters, digits, `_` and `/`, of which `_` stands
// before the two hexadecimal digits of any other byte, itself among them.
#pragma once

#include <string>
#include <string_view>

namespace arbiter::link {

// "/Nav/cmd:o" is "arbiter/source/Nav/cmd_3ao".
[[nodiscard]] std::string topic_of_source(std::string_view source);

// Of the messages that carry tokens.
inline constexpr const char* kTokenTopic = "arbiter/tokens";
// By which links know each other, and ask.
inline constexpr const char* kHostTopic = "arbiter/hosts";
inline constexpr const char* kPulseTopic = "arbiter/pulses";
inline constexpr const char* kQuestionTopic = "arbiter/questions";
inline constexpr const char* kAnswerTopic = "arbiter/answers";

}  // namespace arbiter::link
