// The ports, connections and rules that the operations are counted on.
#pragma once

#include <string>
#include <vector>

namespace arbiter::bench {

// Sources that rules read: active ones and idle ones. T is an hour, so that nothing runs out while
// it is counted, yet has to be compared with the time as usual.
inline std::string active(int i) { return "/active" + std::to_string(i); }
inline std::string idle(int i) { return "/idle" + std::to_string(i); }
inline constexpr int kActive = 8;
inline constexpr int kIdle = 4;

inline constexpr int kFanOuts[] = {1, 8, 64};
inline constexpr int kFanIns[] = {1, 8, 64};

inline std::string fan_out_source(int ports) { return "/wins" + std::to_string(ports); }
inline std::string fan_out_port(int ports, int i) {
  return fan_out_source(ports) + "/in" + std::to_string(i);
}
inline std::string losing_source(int ports) { return "/loses" + std::to_string(ports); }
inline std::string losing_port(int ports, int i) {
  return losing_source(ports) + "/in" + std::to_string(i);
}
inline std::string fan_in_port(int sources) { return "/takes" + std::to_string(sources); }
inline std::string fan_in_source(int sources, int i) {
  return fan_in_port(sources) + "/from" + std::to_string(i);
}

// As a winner's rule that reads eight activities. They are read in the order of their names.
inline std::string holds() {
  std::string rule;
  for (int i = 0; i < 4; ++i) rule += active(i) + " and not " + idle(i) + (i < 3 ? " and " : "");
  return rule;
}

class Model {
 public:
  Model() {
    for (const int ports : kFanOuts) {
      for (int i = 0; i < ports; ++i) {
        at(fan_out_port(ports, i), {{fan_out_source(ports), holds()}});
      }
      for (int i = 0; i < ports; ++i) {
        at(losing_port(ports, i), {{losing_source(ports), losing_by_the_last_of_eight()}});
      }
    }
    at("/loses_by_one/in", {{"/loses_by_one", "not " + active(0)}});
    for (const int sources : kFanIns) {
      // Each overrides those before it.
      std::vector<Select> selects;
      for (int i = 0; i < sources; ++i) {
        std::string condition = sources == 1 ? holds() : "";
        for (int other = i + 1; other < sources; ++other) {
          condition += (condition.empty() ? "not " : " and not ") + fan_in_source(sources, other);
        }
        selects.push_back({fan_in_source(sources, i), condition});
      }
      at(fan_in_port(sources), selects);
    }
    connect("/free", "/free/in");
  }

  [[nodiscard]] std::string model() const {
    return "<behaviors timeout=\"3600s\">" + arbiters_ + "</behaviors>";
  }
  [[nodiscard]] std::string application() const {
    return "<application><name>instructions</name>" + connections_ + "</application>";
  }

 private:
  struct Select {
    std::string from, condition;
  };
  void at(const std::string& port, const std::vector<Select>& selects) {
    arbiters_ += "<arbiter at=\"" + port + "\">";
    for (const Select& select : selects) {
      arbiters_ += "<select from=\"" + select.from + "\">" + select.condition + "</select>";
      connect(select.from, port);
    }
    arbiters_ += "</arbiter>";
  }
  void connect(const std::string& from, const std::string& to) {
    connections_ += "<connection><from>" + from + "</from><to>" + to + "</to></connection>";
  }
  static std::string losing_by_the_last_of_eight() {
    std::string rule;
    for (int i = 0; i < 7; ++i) rule += active(i) + " and ";
    return rule + "not " + active(7);
  }

  std::string arbiters_;
  std::string connections_;
};

}  // namespace arbiter::bench
