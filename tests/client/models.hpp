// Models that the tests put in force.
#pragma once

#include <string>

namespace arbiter::test {

inline std::string rules(const std::string& body, const std::string& timeout = "forever") {
  return "<behaviors timeout=\"" + timeout + "\">" + body + "</behaviors>";
}
inline std::string select(const std::string& from, const std::string& rule = "") {
  return "<select from=\"" + from + "\">" + rule + "</select>";
}
inline std::string arbiter_at(const std::string& port, const std::string& selects) {
  return "<arbiter at=\"" + port + "\">" + selects + "</arbiter>";
}

// At /in: /high overrides /low; nobody gets through while /stop is active. Activity lasts until it
// is ended.
inline std::string override_model(const std::string& timeout = "forever") {
  return rules(
      arbiter_at("/in", select("/low", "not /high and not /stop") + select("/high", "not /stop")),
      timeout);
}

// One source, one port.
inline std::string single_model(const std::string& timeout = "forever") {
  return rules(arbiter_at("/in", select("/out")), timeout);
}

// /in takes this one alone: only("a") takes /a.
inline std::string only(const std::string& source, const std::string& port = "/in") {
  return rules(arbiter_at(port, select("/" + source)));
}

// A source that delivers at several arbitrated ports.
inline std::string fan_out_model(int ports) {
  std::string body;
  for (int i = 0; i < ports; ++i) body += arbiter_at("/in" + std::to_string(i), select("/out"));
  return rules(body);
}

inline std::string application(const std::string& connections) {
  return "<application><name>test</name>" + connections + "</application>";
}
inline std::string connection(const std::string& from, const std::string& to) {
  return "<connection><from>" + from + "</from><to>" + to + "</to></connection>";
}

}  // namespace arbiter::test
