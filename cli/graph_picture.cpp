#include "cli/graph_picture.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <filesystem>
#include <iostream>
#include <set>
#include <stdexcept>
#include <string_view>
#include <vector>

#include <CLI/CLI.hpp>

#include "cli/graph_hosts.hpp"
#include "cli/live.hpp"
#include "cli/model_files.hpp"
#include "cli/output_file.hpp"
#include "cli/port_name.hpp"
#include "cli/port_patterns.hpp"
#include "cli/progress.hpp"
#include "command_line/shell_word.hpp"
#include "drawing/graphviz.hpp"
#include "drawing/only_ports.hpp"
#include "rules/ask/report.hpp"
#include "rules/model/quantifiers.hpp"
#include "rules/text/names.hpp"

namespace arbiter::cli {
namespace {

namespace fs = std::filesystem;
using drawing::View;

// All that Graphviz makes of it but dot, which is ours.
constexpr std::array<std::string_view, 7> kFormats{"svg", "png", "dot", "pdf", "ps", "eps", "jpg"};
constexpr int kLeastDpi = 20, kUsualDpi = 96, kMostDpi = 1200;

std::string format_of(const GraphOptions& options) {
  const auto is_known = [](const std::string& name) {
    return std::find(kFormats.begin(), kFormats.end(), name) != kFormats.end();
  };
  if (!options.format.empty()) {
    if (is_known(options.format)) return options.format;
    throw CLI::ValidationError("--format", options.format + " is none of " + kGraphFormats);
  }
  std::string ending = fs::path(options.output).extension().string();
  if (ending.empty()) return "svg";
  ending.erase(0, 1);
  ending = rules::lower_case(ending);
  if (ending == "gv") return "dot";
  if (is_known(ending)) return ending;
  throw CLI::ValidationError("--output", "no picture is made of the ending of " + options.output +
                                             "; give --format, or one of .svg, .png, .pdf, .ps, "
                                             ".eps, .jpg, .dot and .gv");
}

int dpi_of(const std::string& text, const std::string& format) {
  if (text.empty()) return 0;
  int dpi = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), dpi);
  if (error != std::errc() || end != text.data() + text.size() || dpi < kLeastDpi ||
      dpi > kMostDpi) {
    throw CLI::ValidationError("--dpi", text + " is not a whole number from " +
                                            std::to_string(kLeastDpi) + " to " +
                                            std::to_string(kMostDpi));
  }
  if (format != "png" && format != "jpg" && format != "dot") {
    throw CLI::ValidationError("--dpi", "a picture in " + format +
                                            " has no dots and is sharp at any size; --dpi is for "
                                            "png, jpg and dot");
  }
  return dpi;
}

// "search_and_track" of search_and_track.xml, "humanoid" of humanoid/model.xml.
std::string name_of(const std::string& path) {
  const fs::path file(path);
  const std::string stem = file.stem().string();
  const std::string folder = file.parent_path().filename().string();
  const bool says_nothing = stem == "model" && !folder.empty() && folder.front() != '.';
  return says_nothing ? folder : stem;
}

// Throws std::runtime_error where a name or a pattern fits no input port of the model.
std::set<std::string> chosen_ports(const rules::RuleSet& rules,
                                   const std::vector<std::string>& patterns) {
  std::set<std::string> all, chosen;
  for (const rules::PortRules& each : rules.ports) all.insert(each.port);
  for (const rules::Connection& each : rules.other_connections) all.insert(each.port);
  for (const std::string& pattern : patterns) {
    if (pattern.find('*') == std::string::npos) {
      require_port(rules, pattern, "--port ");
      chosen.insert(pattern);
      continue;
    }
    bool fits_one = false;
    for (const std::string& port : all) {
      if (!rules::matches(pattern, port)) continue;
      fits_one = true;
      chosen.insert(port);
    }
    if (fits_one) continue;
    const std::string similar = rules::similar_pattern(pattern, {all.begin(), all.end()});
    throw std::runtime_error("no input port of the model matches --port " +
                             command_line::shell_word(pattern) +
                             (similar.empty() ? "; `arbiter rules` shows the input ports"
                                              : "; did you mean " + rules::quote(similar) + '?'));
  }
  return chosen;
}

}  // namespace

Picture::Picture(const GraphOptions& options) : options_(options), format_(format_of(options)) {
  page_.dpi = dpi_of(options.dpi, format_);
}

bool Picture::load(const rules::ModelTexts& texts, const std::string& in_force) {
  require_no_input(options_.output, texts);
  require_no_input("--output", options_.output, options_.hosts);
  rules::Diagnostics diagnostics;
  model_ = rules::load_all(texts, diagnostics);
  diagnostics.drop_notes();
  rules::write_text(std::cerr, diagnostics);
  is_good_ = !diagnostics.has_errors();
  if (!is_good_) return false;
  if (!options_.ports.empty()) {
    part_ = drawing::only_ports(model_, chosen_ports(model_.rules, options_.ports));
  }
  choose_view();
  set_title(texts, in_force);
  check();
  find_places();
  return true;
}

void Picture::choose_view() {
  const rules::LoadedModel& drawn = part_ ? *part_ : model_;
  view_ = options_.view == "behaviours"    ? View::kBehaviours
          : options_.view == "connections" ? View::kConnections
          : options_.view == "both"        ? View::kBoth
          : !options_.hosts.empty()        ? View::kConnections  // behaviours are in no boxes
                                           : drawing::natural_view(drawn);
  if (options_.view == "behaviours" && drawn.model.behaviours.empty()) {
    std::cerr << "arbiter: "
              << (part_ ? "no behaviour has to do with this"
                        : "the model has no behaviours, only rules")
              << ": --view connections draws them\n";
  }
}

void Picture::set_title(const rules::ModelTexts& texts, const std::string& in_force) {
  const auto list = [](const auto& items, const auto& text_of) {
    std::string text;
    for (const auto& item : items) text += (text.empty() ? "" : ", ") + text_of(item);
    return text;
  };
  const auto path_of = [](const rules::FileText& file) { return file.path; };
  page_.name = texts.models.empty() ? "" : name_of(texts.models.front().path);
  if (page_.name.empty() && texts.application) page_.name = name_of(texts.application->path);
  page_.details = {list(texts.models, path_of)};
  if (texts.application) page_.details.push_back("application: " + texts.application->path);
  if (!options_.hosts.empty()) page_.details.push_back("hosts: " + options_.hosts);
  if (!in_force.empty()) page_.details.push_back(in_force);
  if (part_) {
    page_.details.push_back("only what decides at " +
                            list(options_.ports, [](const std::string& port) { return port; }));
  }
  std::erase(page_.details, "");
}

void Picture::check() {
  rules::Diagnostics proof;
  compile_model(model_.rules, proof, options_.effort);
  is_good_ = !proof.has_errors();
  proof.drop_notes();
  if (!is_good_) rules::write_text(std::cerr, proof);
}

void Picture::find_places() {
  if (options_.hosts.empty()) return;
  rules::Diagnostics diagnostics;
  places_ = places_by(options_.hosts, model_.rules, diagnostics);
  is_good_ = is_good_ && !diagnostics.has_errors();
  diagnostics.drop_notes();
  rules::write_text(std::cerr, diagnostics);
}

std::string Picture::lay_out(const std::string& text) const {
  ProgressLine progress;
  const drawing::Waiting waiting{[&] {
    if (interrupts_ != nullptr && sleep_until(0, *interrupts_)) throw PictureInterrupted();
    progress.show([&] {
      return "Graphviz lays the picture out, for " + std::to_string(progress.elapsed().count()) +
             " s now; --port draws a part, " +
             (page_.dpi > kUsualDpi ? "a smaller --dpi takes less, " : "") +
             "--format dot does without it";
    });
  }};
  drawing::Layout layout = drawing::lay_out(text, format_, waiting);
  progress.clear();
  if (layout.is_shrunk) {
    std::cerr << "arbiter: Graphviz makes at most 32767 dots on a side, so the picture is smaller "
                 "than --dpi says; svg has no such bound\n";
  }
  return std::move(layout.picture);
}

void Picture::write(const drawing::Situation* situation, const drawing::Places* places) {
  if (places == nullptr && situation == nullptr && places_) places = &*places_;
  std::string text = drawing::draw(part_ ? *part_ : model_, view_, page_, situation, places);
  if (text == last_) return;
  write_output(options_.output, format_ == "dot" ? text : lay_out(text));
  last_ = std::move(text);
}

}  // namespace arbiter::cli
