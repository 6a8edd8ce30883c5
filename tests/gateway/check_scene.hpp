// Mappings as text, checked beside a model.
#pragma once

#include <gmock/gmock.h>

#include <string>
#include <utility>

#include "rules/model/load.hpp"
#include "tests/gateway/mapping_text.hpp"

namespace arbiter::gateway {

inline constexpr const char* kModel =
    "<behaviors timeout='500ms'>"
    "<source port='/EStop/pressed:o' timeout='forever'/>"
    "<behavior name='Drive'><config at='/Base/cmd:i'>/Nav/cmd:o</config>"
    "<condition>not /EStop/pressed:o</condition></behavior>"
    "</behaviors>";

// What is found of the entries of a gateway (its line 1), in that model; empty: without one.
inline Read check(const std::string& mapping, const std::string& model = kModel) {
  Read read = read_text(mapping);
  EXPECT_THAT(read.findings(), testing::IsEmpty());
  if (model.empty()) {
    check_mappings({read.mapping}, nullptr, read.diagnostics);
    return read;
  }
  rules::Diagnostics of_model;
  rules::ModelTexts texts;
  texts.models.push_back({"model.xml", model});
  const rules::RuleSet rules = rules::load(std::move(texts), of_model);
  EXPECT_FALSE(of_model.has_errors());
  check_mappings({read.mapping}, &rules, read.diagnostics);
  return read;
}

inline std::string dds(const std::string& entries, const std::string& more = "") {
  return "<gateway kind='dds' " + more + ">" + entries + "</gateway>";
}

inline std::string in(const std::string& topic, const std::string& port,
                      const std::string& more = "") {
  return "<in topic='" + topic + "' type='geometry_msgs/msg/Twist' port='" + port + "' " + more +
         "/>";
}
inline std::string out(const std::string& topic, const std::string& port,
                       const std::string& more = "") {
  return "<out topic='" + topic + "' type='geometry_msgs/msg/Twist' port='" + port +
         "' idle='zero' " + more + "/>";
}

}  // namespace arbiter::gateway
