#include "bench/harness/picture.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>
#include <stdexcept>
#include <string_view>
#include <vector>

#include "bench/harness/report.hpp"

namespace arbiter::bench {
namespace {

using Json = nlohmann::json;

// In pixels. A row has its name, a bar, and what was measured.
constexpr double kWidth = 880, kLeft = 330, kRight = 690, kRow = 22;
constexpr double kMillisecond = 1e6, kLeastSlow = 1e5;  // ns

struct Target {
  std::string name, unit, group;
  double limit = 0;
  std::optional<double> measured;
  bool is_met = false;
};

struct Group {
  std::string title, unit;
  double least, most;            // of the axis, which is logarithmic
  std::optional<double> origin;  // where bars begin, if not at the left
  std::vector<Target> rows;
};

std::string escaped(std::string_view text) {
  std::string result;
  for (const char c : text) {
    if (c == '<') {
      result += "&lt;";
    } else if (c == '&') {
      result += "&amp;";
    } else if (c == '"') {
      result += "&quot;";
    } else if (static_cast<unsigned char>(c) >= 0x20) {
      result += c;
    }
  }
  return result;
}

template <typename... Values>
std::string format(const char* pattern, Values... values) {
  char text[256];
  std::snprintf(text, sizeof text, pattern, values...);
  return text;
}

std::string amount(double value, const std::string& unit) {
  return format(value != 0 && std::abs(value) < 1000 ? "%.3g" : "%.0f", value) + " " +
         (unit == "x" ? "×" : unit);
}

std::vector<Target> targets_of(const Json& report) {
  std::vector<Target> targets;
  if (!report.contains("targets")) {
    throw std::runtime_error("this is no report: it has no targets");
  }
  for (const Json& each : report.at("targets")) {
    Target target{each.at("name").get<std::string>(),
                  each.at("unit").get<std::string>(),
                  each.value("group", ""),
                  each.at("limit").get<double>(),
                  std::nullopt,
                  each.at("met").get<bool>()};
    if (each.contains("measured")) target.measured = each.at("measured").get<double>();
    targets.push_back(std::move(target));
  }
  return targets;
}

// The decades, or thirds of them, that hold all rows.
void fit_axis(Group& group) {
  group.least = 1e300;
  group.most = 1e-300;
  const auto take = [&](double value) {
    if (value <= 0) return;
    value = std::clamp(value, 1e-12, 1e12);
    group.least = std::min(group.least, value);
    group.most = std::max(group.most, value);
  };
  for (const Target& row : group.rows) {
    take(row.limit);
    take(row.measured.value_or(0));
  }
  if (group.origin) take(*group.origin);
  if (group.least > group.most) return;  // nothing that a logarithm has
  group.least = std::pow(10, std::floor(std::log10(group.least)));
  group.most = std::pow(10, std::ceil(std::log10(group.most)));
  if (group.least == group.most) group.most *= 10;
}

std::vector<Group> groups_of(const std::vector<Target>& targets) {
  std::vector<Group> groups{
      {"Beside others, in the same run: Arbiter's time over theirs", "x", 1, 1, 1, {}},
      {"Through a gateway, in the same run: its cost over a plain relay's", "x", 1, 1, 1, {}},
      {"Calls on the data path, in nanoseconds", "ns", 1, 1, {}, {}},
      {"Setting up, in milliseconds", "ms", 1, 1, {}, {}},
      {"Other", "", 1, 1, {}, {}}};
  for (Target target : targets) {
    std::size_t group = target.unit == "x" ? 0 : target.unit == "ns" ? 2 : 4;
    if (group == 0 && target.group == kGateways) group = 1;
    if (target.unit == "ns" && target.limit >= kLeastSlow) {
      group = 3;
      target.unit = "ms";
      target.limit /= kMillisecond;
      if (target.measured) *target.measured /= kMillisecond;
    }
    groups[group].rows.push_back(std::move(target));
  }
  std::erase_if(groups, [](const Group& group) { return group.rows.empty(); });
  for (Group& group : groups) fit_axis(group);
  return groups;
}

class Svg {
 public:
  void text(double x, double y, const char* kind, const std::string& content) {
    body_ += format("<text x=\"%g\" y=\"%g\" class=\"%s\">", x, y, kind) + escaped(content) +
             "</text>\n";
  }
  void line(double x1, double y1, double x2, double y2, const char* kind) {
    body_ += format("<line x1=\"%g\" y1=\"%g\" x2=\"%g\" y2=\"%g\" class=\"%s\"/>\n", x1, y1, x2,
                    y2, kind);
  }
  void bar(double x1, double x2, double y, const char* kind) {
    body_ += format("<rect x=\"%g\" y=\"%g\" width=\"%g\" height=\"12\" class=\"%s\"/>\n",
                    std::min(x1, x2), y, std::max(1.0, std::abs(x2 - x1)), kind);
  }
  [[nodiscard]] std::string take(double height) const {
    const std::string size = format("%g %g", kWidth, height);
    return "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 " + size + "\" " +
           format("width=\"%g\" height=\"%g\" role=\"img\">\n", kWidth, height) +
           "<title>What arbitration costs</title>\n"
           "<style>\n"
           "text{font:13px Helvetica,Arial,sans-serif;fill:#1b2230}\n"
           ".title{font-size:19px;font-weight:bold}.group{font-weight:bold}\n"
           ".soft,.tick{fill:#5b6577;font-size:12px}.tick{text-anchor:middle}\n"
           ".name{text-anchor:end}.grid{stroke:#dde2ea}.origin{stroke:#1b2230}\n"
           ".limit{stroke:#1b2230;stroke-width:2.5}\n"
           ".met{fill:#0072B2}.missed{fill:#E69F00;stroke:#8a5a00}\n"
           "</style>\n"
           "<rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n" +
           body_ + "</svg>\n";
  }

 private:
  std::string body_;
};

double place(const Group& group, double value) {
  const double share =
      std::log10(std::max(value, group.least) / group.least) / std::log10(group.most / group.least);
  return kLeft + (kRight - kLeft) * std::min(1.0, share);
}

void draw_row(const Group& group, const Target& row, double y, Svg& out) {
  out.text(kLeft - 8, y + 15, "name", row.name);
  if (!row.measured) {
    out.text(kRight + 12, y + 15, "soft", "not measured");
    return;
  }
  if (*row.measured > 0) {
    out.bar(place(group, group.origin.value_or(group.least)), place(group, *row.measured), y + 5,
            row.is_met ? "met" : "missed");
  }
  if (row.limit > 0) {
    out.line(place(group, row.limit), y + 2, place(group, row.limit), y + 20, "limit");
  }
  out.text(kRight + 12, y + 15, "value",
           amount(*row.measured, row.unit) +
               (row.is_met ? "" : "  ✗ over " + amount(row.limit, row.unit)));
}

double draw_group(const Group& group, double y, Svg& out) {
  out.text(16, y + 14, "group", group.title);
  y += 24;
  const double bottom = y + kRow * static_cast<double>(group.rows.size());
  for (double decade = group.least; decade <= group.most * 1.01; decade *= 10) {
    out.line(place(group, decade), y, place(group, decade), bottom, "grid");
    out.text(place(group, decade), bottom + 14, "tick", amount(decade, group.unit));
  }
  for (const Target& row : group.rows) {
    draw_row(group, row, y, out);
    y += kRow;
  }
  if (group.origin) {
    const double x = place(group, *group.origin);
    out.line(x, bottom - kRow * static_cast<double>(group.rows.size()), x, bottom, "origin");
  }
  return bottom + 30;
}

// What there is of these facts, in a line.
std::string facts(const Json& machine, const std::vector<std::string>& keys) {
  std::string text;
  for (const std::string& key : keys) {
    if (!machine.contains(key)) continue;
    const Json& fact = machine.at(key);
    const std::string value = fact.is_string() ? fact.get<std::string>() : fact.dump();
    if (value.empty() || value == "none") continue;
    text += (text.empty() ? "" : " · ") + (fact.is_string() ? value : value + " " + key);
  }
  return text;
}

}  // namespace

std::string picture(const Json& given) {
  // What others have said may be in whatever encoding.
  const Json report = Json::parse(given.dump(-1, ' ', false, Json::error_handler_t::replace));
  const auto targets = targets_of(report);
  const auto met = std::count_if(targets.begin(), targets.end(),
                                 [](const Target& target) { return target.is_met; });
  Svg out;
  out.text(16, 30, "title", "What arbitration costs");
  out.text(16, 52, "soft",
           (report.value("quick", false) ? "./run bench --quick" : "./run bench") +
               std::string(": ") + std::to_string(met) + " of " + std::to_string(targets.size()) +
               " targets met. Medians, unless a row says otherwise. Left is better; all axes are "
               "logarithmic.");
  const Json machine = report.value("machine", Json::object());
  double y = 70;
  for (const std::string& line :
       {facts(machine, {"date", "processor", "virtualised", "usable processors", "arbiter"}),
        report.value("source", "")}) {
    if (line.empty()) continue;
    out.text(16, y, "soft", line);
    y += 18;
  }
  for (const Json& warning : report.value("warnings", Json::array())) {
    out.text(16, y, "soft", "⚠ " + warning.get<std::string>());
    y += 18;
  }
  out.line(24, y - 9, 24, y + 7, "limit");
  out.text(34, y + 4, "soft", "the most that the project allows itself");
  y += 24;
  for (const Group& group : groups_of(targets)) y = draw_group(group, y, out);
  if (targets.empty()) out.text(16, y - 4, "soft", "Nothing was measured that has a target.");
  return out.take(y);
}

}  // namespace arbiter::bench
