#include "drawing/ports.hpp"

#include <algorithm>
#include <set>

#include "drawing/text.hpp"
#include "rules/model/print_rules.hpp"

namespace arbiter::drawing {
namespace {

constexpr std::size_t kMaxPort = 40, kMaxName = 28, kMaxFormula = 60;  // characters
constexpr std::size_t kMaxLines = 4;                                   // of a rule

// As high as so many lines of a rule, so that rows of two tables can be level.
std::string cell(const std::string& id, const char* align, const char* fill,
                 const std::string& content, std::size_t lines = 1) {
  return "<TR><TD PORT=\"" + id + "\" ALIGN=\"" + align + "\" BGCOLOR=\"" + fill + "\" HEIGHT=\"" +
         std::to_string(9 + 11 * lines) + "\">" + content + "</TD></TR>";
}

std::string lines_of(const rules::ConnectionRule& rule) {
  return in_lines(to_string(rule), kMaxFormula, kMaxLines);
}

std::size_t count_lines(const std::string& text) {
  return 1 + static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
}

void find_sensed(Input& in) {
  if (in.rules == nullptr) return;
  std::set<std::string> read, connected(in.others.begin(), in.others.end());
  std::set<const rules::Expression*> seen;
  for (const rules::ConnectionRule& rule : in.rules->rules) {
    connected.insert(rule.source);
    rules::add_sources_of(*rule.condition, read, seen);
  }
  for (const std::string& source : read) {
    if (!connected.contains(source)) in.sensed.push_back(source);
  }
}

}  // namespace

std::map<std::string, Input> find_inputs(const rules::RuleSet& rules) {
  std::map<std::string, Input> inputs;
  for (const rules::PortRules& port : rules.ports) inputs[port.port].rules = &port;
  for (const rules::Connection& connection : rules.other_connections) {
    inputs[connection.port].others.push_back(connection.source);
  }
  for (auto& [port, in] : inputs) {
    in.port = port;
    find_sensed(in);
  }
  return inputs;
}

std::string Ports::host_of_source(const std::string& source) const {
  return places_ == nullptr ? std::string() : places_->host_of_source(source);
}

std::string Ports::host_of_port(const std::string& port) const {
  return places_ == nullptr ? std::string() : places_->host_of_port(port);
}

const Situation* Ports::situation_on(const std::string& host) const {
  return host.empty() ? situation_ : places_->boxes.at(host).situation;
}

const Situation* Ports::situation_at(const std::string& port) const {
  return situation_on(host_of_port(port));
}

bool Ports::is_active(const std::string& source, const std::string& port) const {
  const Situation* const situation = situation_at(port);
  return situation != nullptr && situation->active.contains(source);
}

bool Ports::wins(const std::string& source, const std::string& port) const {
  const Situation* const situation = situation_at(port);
  if (situation == nullptr) return false;
  const auto winner = situation->winners.find(port);
  return winner != situation->winners.end() && winner->second == source;
}

void Ports::open_box(const std::string& host) {
  if (host.empty()) return;
  out_.note_sign(kHostBox);
  out_.open("subgraph cluster_h" + std::to_string(boxes_++));
  std::string rows = row("<B>" + html(shortened(host, kMaxName)) + "</B>");
  for (const std::string& each : places_->boxes.at(host).captions) {
    rows += row(small(html(shortened(each, kMaxFormula))));
  }
  out_.attribute("style", "rounded");
  out_.attribute("color", quoted(colour::kBlack));
  out_.attribute("bgcolor", quoted(colour::kPaleGrey));
  out_.attribute("margin", "12");
  out_.attribute("labeljust", "l");
  out_.attribute("tooltip", quoted("host " + host));
  out_.attribute("label", R"(<<TABLE BORDER="0" CELLBORDER="0" CELLSPACING="1" CELLPADDING="0">)" +
                              rows + "</TABLE>>");
}

void Ports::close_box(const std::string& host) {
  if (!host.empty()) out_.close();
}

std::string Ports::title_row(const std::string& name) {
  return R"(<TR><TD BGCOLOR=")" + std::string(colour::kBlack) + R"("><FONT COLOR="white"><B>)" +
         html(shortened(name, kMaxName)) + "</B></FONT></TD></TR>";
}

std::string Ports::table(const std::string& rows) {
  return R"(<<TABLE BORDER="0" CELLBORDER="1" CELLSPACING="0" CELLPADDING="3">)" + rows +
         "</TABLE>>";
}

std::string Ports::rule_row(const rules::ConnectionRule& rule, const std::string& port,
                            const std::string& id) const {
  const Mark& mark = look_of(wins(rule.source, port)        ? MarkKind::kRuns
                             : is_active(rule.source, port) ? MarkKind::kOverridden
                                                            : MarkKind::kInactive);
  std::string text = situation_at(port) == nullptr ? "" : std::string(mark.sign) + " ";
  text += lines_of(rule);
  return cell(id, "LEFT", mark.colour, small(html_lines(text)), count_lines(text));
}

std::string Ports::input_rows(const Input& in, const std::string& id) const {
  const std::string name = html("▸ " + shortened(in.port, kMaxPort));
  if (in.rules == nullptr) return cell(id, "LEFT", colour::kWhite, name);
  std::string rows =
      cell(id, "LEFT", colour::kShade,
           name + "  " +
               small("<I>arbiter" +
                     std::string(in.rules->first_wins ? ", the first that holds" : "") + "</I>"));
  for (std::size_t i = 0; i < in.rules->rules.size(); ++i) {
    rows += rule_row(in.rules->rules[i], in.port, id + "r" + std::to_string(i));
  }
  for (std::size_t i = 0; i < in.others.size(); ++i) {
    const std::string text = shortened(in.others[i], kMaxPort) + ": no rule, never delivers";
    rows += cell(id + "n" + std::to_string(i), "LEFT", colour::kWhite,
                 small("<I>" + html(text) + "</I>"));
  }
  return rows;
}

std::string Ports::text_behind(const std::string& source, const std::string& host) const {
  const auto in = [&](const std::map<std::string, std::string>& texts) {
    const auto found = texts.find(source);
    return found == texts.end() ? std::string() : found->second;
  };
  std::string text;
  if (places_ != nullptr) {
    const std::string home = host_of_source(source);
    if (home != host) text = home.empty() ? "no host" : "host " + home;
    const std::string note = in(places_->notes);
    text += (text.empty() || note.empty() ? "" : ", ") + note;
  } else if (situation_ != nullptr) {
    const std::string home = in(situation_->hosts);
    if (!home.empty()) text = "host " + home;
  }
  return text.empty() ? text : " (" + text + ")";
}

std::string Ports::output_row(const std::string& source, const std::string& host,
                              const std::string& id, const rules::ConnectionRule* beside) const {
  const Situation* const situation = situation_on(host_of_source(source));
  const bool is_active = situation != nullptr && situation->active.contains(source);
  const Mark& mark = look_of(is_active ? MarkKind::kActive : MarkKind::kInactive);
  const std::string sign = situation == nullptr ? "" : std::string(mark.sign) + " ";
  return cell(id, "RIGHT", mark.colour,
              html(sign + shortened(source, kMaxPort) + text_behind(source, host) + " ▸"),
              beside == nullptr ? 1 : count_lines(lines_of(*beside)));
}

std::string Ports::rest_row(const std::vector<std::string>& sources, const std::string& port,
                            const std::string& id) const {
  const auto active = std::count_if(sources.begin(), sources.end(), [&](const std::string& source) {
    return is_active(source, port);
  });
  const Mark& mark = look_of(active != 0 ? MarkKind::kActive : MarkKind::kInactive);
  std::string text = "and " + std::to_string(sources.size()) + " more, only sensed";
  if (situation_at(port) != nullptr) text += ", " + std::to_string(active) + " of them active";
  return cell(id, "RIGHT", mark.colour, small("<I>" + html(text) + "</I>"));
}

void Ports::draw_rest(const std::vector<std::string>& sources, const std::string& port,
                      const std::string& tail, const std::string& head) {
  std::string text;
  for (const std::string& source : sources) {
    text.append(source).append(" is sensed at ").append(port).append("\n");
  }
  text.pop_back();
  out_.line(LineKind::kSensed, tail + ":e -> " + head + ":w", {{"tooltip", quoted(text)}});
}

void Ports::draw_selected(const rules::ConnectionRule& rule, const std::string& port,
                          const std::string& arrow) {
  const LineKind kind = situation_at(port) == nullptr  ? LineKind::kSelected
                        : wins(rule.source, port)      ? LineKind::kWins
                        : is_active(rule.source, port) ? LineKind::kOverridden
                                                       : LineKind::kInactive;
  out_.line(kind, arrow,
            {{"tooltip", quoted(rule.source + " → " + port +
                                (rule.behaviour.empty() ? "" : "\n" + rule.behaviour) + "\n" +
                                to_string(rule) + "\n" + place(rule.where))}});
}

void Ports::draw_other(const Input& in, const std::string& source, const std::string& arrow) {
  const bool arbitrated = in.rules != nullptr;
  out_.line(arbitrated ? LineKind::kWithoutRule : LineKind::kUnarbitrated, arrow,
            {{"tooltip", quoted(source + " → " + in.port +
                                (arbitrated ? "\nno rule selects it" : "\nnot arbitrated"))}});
}

void Ports::draw_sensed(const std::string& source, const std::string& port,
                        const std::string& arrow) {
  out_.line(LineKind::kSensed, arrow,
            {{"penwidth", is_active(source, port) ? "2.5" : ""},
             {"tooltip", quoted(source + " is sensed at " + port)}});
}

}  // namespace arbiter::drawing
