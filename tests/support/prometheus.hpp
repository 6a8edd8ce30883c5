// Reads Prometheus's text format (version 0.0.4) by its specification, and by the conventions for
// names: what a monitoring system would refuse, or promtool complain of, throws.
#pragma once

#include <cmath>
#include <cstdlib>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string>

namespace arbiter::test {

using MetricLabels = std::map<std::string, std::string>;

struct Metric {
  std::string type;
  std::map<MetricLabels, double> samples;
};

class PrometheusReader {
 public:
  std::map<std::string, Metric> read(const std::string& text) {
    if (text.empty() || text.back() != '\n') fail("the last line does not end");
    std::istringstream lines(text);
    while (std::getline(lines, line_)) take_line();
    return metrics_;
  }

 private:
  [[noreturn]] void fail(const std::string& why) const {
    throw std::runtime_error(why + ": " + line_);
  }
  void require(bool is_so, const std::string& what) const {
    if (!is_so) fail(what);
  }

  void take_line() {
    at_ = 0;
    if (!line_.starts_with("# ")) return take_sample();
    std::istringstream words(line_.substr(2));
    std::string keyword, name, rest;
    words >> keyword >> name;
    std::getline(words >> std::ws, rest);
    if (keyword == "HELP") {
      require(helped_.insert(name).second, "helped twice");
      require(!rest.empty() && rest.find('\\') == std::string::npos, "no help");
      begin(name);
    } else {
      require(keyword == "TYPE" && name == current_ && metrics_[name].type.empty(),
              "a type that is out of place");
      require(rest == "counter" || rest == "gauge", "an unknown type");
      const bool is_total = name.ends_with("_total");
      require((rest == "counter") == is_total, "counters end in _total, and nothing else does");
      metrics_[name].type = rest;
    }
  }

  void begin(const std::string& name) {
    static const std::regex valid("[a-z][a-z0-9_]*");
    require(std::regex_match(name, valid), "not a name");
    require(!metrics_.contains(name), "the samples of one metric do not stand together");
    for (const char* unit : {"_ms", "_ns", "_us", "_milliseconds", "_nanoseconds", "_kilobytes"}) {
      require(name.find(unit) == std::string::npos, "not a base unit");
    }
    metrics_[name];
    current_ = name;
  }

  void take_sample() {
    const std::string name = word("{ ");
    require(name == current_ && !metrics_[name].type.empty(), "a sample that is out of place");
    MetricLabels labels;
    if (line_[at_] == '{') {
      for (++at_; line_.at(at_) != '}';) {
        const std::string label = word("=");
        static const std::regex valid("[a-zA-Z_][a-zA-Z0-9_]*");
        require(std::regex_match(label, valid) && !label.starts_with("__"), "not a label");
        require(line_.at(++at_) == '"', "no quote");
        ++at_;
        require(labels.emplace(label, label_value()).second, "a label twice");
        if (line_.at(at_) == ',') ++at_;
      }
      ++at_;
    }
    require(line_.at(at_) == ' ', "no value");
    const std::string value = line_.substr(at_ + 1);
    char* end = nullptr;
    const double number = value == "+Inf" ? INFINITY : std::strtod(value.c_str(), &end);
    require(!value.empty() && (value == "+Inf" || *end == '\0'), "not a number");
    require(metrics_[name].samples.emplace(labels, number).second, "a sample twice");
  }

  std::string word(const char* ends) {
    const auto end = line_.find_first_of(ends, at_);
    require(end != std::string::npos && end != at_, "a word is missing");
    const std::string result = line_.substr(at_, end - at_);
    at_ = end;
    return result;
  }

  // Up to the quote that closes it, and behind that.
  std::string label_value() {
    std::string value;
    for (; line_.at(at_) != '"'; ++at_) {
      char c = line_[at_];
      if (c == '\\') {
        c = line_.at(++at_);
        require(c == '\\' || c == '"' || c == 'n', "an unknown escape");
        if (c == 'n') c = '\n';
      }
      value += c;
    }
    ++at_;
    return value;
  }

  std::map<std::string, Metric> metrics_;
  std::set<std::string> helped_;
  std::string current_;
  std::string line_;
  std::size_t at_ = 0;
};

inline std::map<std::string, Metric> read_metrics(const std::string& text) {
  return PrometheusReader().read(text);
}

}  // namespace arbiter::test
