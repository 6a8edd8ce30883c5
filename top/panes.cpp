#include "top/panes.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdio>
#include <ctime>
#include <initializer_list>
#include <limits>

namespace arbiter::top {
namespace {

constexpr std::size_t kBarWidth = 10;
constexpr double kLast = std::numeric_limits<double>::max();  // in an ascending order

std::string lower(std::string text) {
  for (char& each : text) each = static_cast<char>(std::tolower(static_cast<unsigned char>(each)));
  return text;
}

bool matches(const std::string& filter, std::initializer_list<std::string> texts) {
  return filter.empty() || std::any_of(texts.begin(), texts.end(), [&](const std::string& text) {
           return lower(text).find(lower(filter)) != std::string::npos;
         });
}

Cell number(const std::string& text, double order, Style style = Style::kPlain) {
  return {text, style, order};
}
Cell rate_cell(double per_second, Style style = Style::kPlain) {
  return {rate(per_second), per_second > 0 ? style : Style::kDim, per_second};
}
// Three that are easily taken for each other: it is not known (yet); there is nothing that it could
// be told of; and 0, which rate() says.
Cell unknown() { return {"?", Style::kDim, kLast}; }
Cell nothing() { return {"", Style::kDim, kLast}; }

Cell name_cell(const std::string& name, Style style = Style::kPlain) {
  return {name, style, 0, {{0, name.size()}}};
}

Cell age_cell(shm::Nanoseconds now, shm::Nanoseconds then) {
  if (then <= 0) return nothing();
  return number(span(now - then), static_cast<double>(now - then));
}

Cell winner_cell(const Frame& frame, std::size_t port) {
  const std::int32_t winner = frame.ports[port].winner;
  if (winner == kNobody) return {"idle", Style::kIdle};
  if (winner == kNotArbitrated) return {"(all: not arbitrated)", Style::kDim};
  if (winner < 0) return unknown();
  const std::string& name = frame.census->sources[static_cast<std::size_t>(winner)].name;
  if (frame.census->ports[port].useless == name) {
    return {"! " + name, Style::kWarning, 0, {{2, name.size()}}};
  }
  return name_cell(name, Style::kWinner);
}

Cell since_cell(const Frame& frame, const PortState& state) {
  if (state.winner == kNotArbitrated) return nothing();
  if (state.since == 0 || state.winner == kNotKnown) return unknown();
  const shm::Nanoseconds time = frame.now - state.since;
  return number((state.is_exact ? "" : ">") + span(time), static_cast<double>(time));
}

Cell queue_cell(const Frame& frame, const PortFact& port) {
  if (!port.is_open) return nothing();
  if (!frame.is_counted) return unknown();
  const bool is_full = port.depth != 0 && port.waiting >= port.depth;
  return number(std::to_string(port.waiting) + "/" + std::to_string(port.depth),
                static_cast<double>(port.waiting), is_full ? Style::kWarning : Style::kPlain);
}

Cell oldest_cell(const Frame& frame, const PortState& state) {
  if (!state.is_tapped) return nothing();
  if (!state.oldest || !frame.is_counted) return unknown();
  if (*state.oldest == 0) return number("none", 0);
  return number("<" + span(*state.oldest), static_cast<double>(*state.oldest));
}

Cell wait_cell(const PortState& state, shm::Nanoseconds Waits::*of) {
  if (!state.is_tapped) return nothing();
  if (!state.waits) return number("none", 0);
  const shm::Nanoseconds wait = (*state.waits).*of;
  return number(short_span(wait), static_cast<double>(wait));
}

struct ActivityCells {
  Cell bar;
  Cell state;
};
ActivityCells activity_cells(const Frame& frame, std::size_t source, Charset charset) {
  const shm::ActivityWord word = frame.words[source];
  const shm::Nanoseconds timeout = frame.census->sources[source].timeout;
  if (shm::is_deactivation(word)) return {{"", Style::kDim, 0}, {"ended", Style::kDim}};
  if (!shm::is_active(word, frame.now)) {
    return {{"", Style::kDim, 0}, {word == shm::kNeverActive ? "never" : "silent", Style::kDim}};
  }
  const bool is_finite = shm::is_finite(word) && timeout != shm::kForever && timeout > 0;
  const double left =
      is_finite ? static_cast<double>(word - frame.now) / static_cast<double>(timeout) : 1;
  return {number(bar(left, kBarWidth, charset), left, Style::kBar), {"active", Style::kWinner}};
}

std::string timeout_text(shm::Nanoseconds timeout) {
  if (timeout == shm::kForever) return "forever";
  if (timeout < 1'000'000) return std::to_string(timeout / 1'000) + " us";
  return span(timeout);
}

// Marked where the publisher is slower.
Cell timeout_cell(const Frame& frame, std::size_t source) {
  const shm::Nanoseconds timeout = frame.census->sources[source].timeout;
  const bool is_slow = frame.slow_period(source) != 0;
  return number((is_slow ? "!" : "") + timeout_text(timeout), static_cast<double>(timeout),
                is_slow ? Style::kWarning : Style::kPlain);
}

Row port_row(const Frame& frame, std::size_t i) {
  const PortFact& port = frame.census->ports[i];
  const PortState& state = frame.ports[i];
  const Cell last =
      state.winner >= 0
          ? age_cell(frame.now, frame.last_event(static_cast<std::size_t>(state.winner)))
          : (state.winner == kNotKnown ? unknown() : nothing());
  Row row{port.name, {name_cell(port.name), winner_cell(frame, i), since_cell(frame, state), last}};
  row.is_marked = state.is_tapped;
  if (port.rates && frame.is_counted) {
    row.cells.push_back(rate_cell(port.rates->taken));
    row.cells.push_back(rate_cell(port.rates->lost, Style::kWarning));
    row.cells.push_back(rate_cell(port.rates->discarded));
  } else {
    row.cells.insert(row.cells.end(), 3, port.is_open ? unknown() : nothing());
  }
  row.cells.push_back(queue_cell(frame, port));
  row.cells.push_back({port.component, port.is_open ? Style::kPlain : Style::kDim});
  row.cells.push_back(wait_cell(state, &Waits::half));
  row.cells.push_back(wait_cell(state, &Waits::almost));
  row.cells.push_back(oldest_cell(frame, state));
  return row;
}

Cell change_cell(const Takeover& change, const std::string& arrow) {
  Cell cell{"", change.winner.empty() ? Style::kIdle : Style::kWinner};
  const auto add = [&](const std::string& source) {
    if (!source.empty()) cell.names.push_back({cell.text.size(), source.size()});
    cell.text += source.empty() ? "idle" : source;
  };
  add(change.before);
  cell.text += arrow;
  add(change.winner);
  return cell;
}

// Of a cause, "/Face/pos:o became active, /Rest/pos:o went inactive": what stands between a slash
// and a blank.
std::vector<NamePlace> names_in(const std::string& text) {
  std::vector<NamePlace> names;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find(' ', begin), text.size());
    if (text[begin] == '/') names.push_back({begin, end - begin});
    begin = end + 1;
  }
  return names;
}

Row source_row(const Frame& frame, std::size_t i, Charset charset) {
  const SourceFact& source = frame.census->sources[i];
  const ActivityCells activity = activity_cells(frame, i, charset);
  Row row{source.name,
          {name_cell(source.name), activity.bar, activity.state, timeout_cell(frame, i),
           age_cell(frame.now, frame.last_event(i))}};
  if (source.rates && frame.is_counted) {
    row.cells.push_back(rate_cell(source.rates->published));
    row.cells.push_back(rate_cell(source.rates->signals));
  } else {
    row.cells.insert(row.cells.end(), 2, source.is_open ? unknown() : nothing());
  }
  row.cells.push_back({source.component, source.is_open ? Style::kPlain : Style::kDim});
  row.cells.push_back({source.host});
  return row;
}

// Whether any source comes from another host.
bool is_any_imported(const Frame& frame) {
  const auto& sources = frame.census->sources;
  return std::any_of(sources.begin(), sources.end(),
                     [](const SourceFact& source) { return !source.host.empty(); });
}

std::size_t longest_source(const Frame& frame, Charset charset) {
  std::size_t longest = 0;
  for (const SourceFact& each : frame.census->sources) {
    longest = std::max(longest, columns_of(safe(each.name, charset)));
  }
  return longest;
}

}  // namespace

bool is_any_tapped(const Frame& frame) {
  return std::any_of(frame.ports.begin(), frame.ports.end(),
                     [](const PortState& port) { return port.is_tapped; });
}

Table ports_table(const Frame& frame, const std::string& filter, Charset charset) {
  Table table;
  table.columns = {{"INPUT PORT", 0, Align::kLeft, 0, false, 20},
                   {"WINNER", 0, Align::kLeft, 0, false, 20, longest_source(frame, charset)},
                   {"SINCE", 7, Align::kRight, 1, true},
                   {"LAST", 6, Align::kRight, 2, true},
                   {"TAKEN", 6, Align::kRight, 3, true},
                   {"LOST", 5, Align::kRight, 5, true},
                   {"LOSERS", 7, Align::kRight, 6, true},
                   {"QUEUE", 7, Align::kRight, 4, true},
                   {"COMPONENT", 0, Align::kLeft, 7, false}};
  if (is_any_tapped(frame)) {
    table.columns.push_back({"P50", 6, Align::kRight, 2, true});
    table.columns.push_back({"P99", 6, Align::kRight, 2, true});
    table.columns.push_back({"OLDEST", 7, Align::kRight, 3, true});
  }
  for (std::size_t i = 0; i < frame.ports.size(); ++i) {
    Row row = port_row(frame, i);
    row.cells.resize(table.columns.size());
    if (matches(filter, {row.name, row.cells[1].text})) table.rows.push_back(std::move(row));
  }
  return table;
}

Table sources_table(const Frame& frame, const std::string& filter, Charset charset) {
  Table table;
  table.columns = {
      {"SOURCE", 0, Align::kLeft, 0, false, 24}, {"ACTIVITY", kBarWidth, Align::kLeft, 3, true},
      {"", 6, Align::kLeft, 0, false},           {"T", 7, Align::kRight, 4, true},
      {"LAST", 6, Align::kRight, 1, true},       {"RATE", 6, Align::kRight, 2, true},
      {"SIGNALS", 8, Align::kRight, 6, true},    {"COMPONENT", 0, Align::kLeft, 5, false}};
  if (is_any_imported(frame)) table.columns.push_back({"HOST", 0, Align::kLeft, 2, false});
  for (std::size_t i = 0; i < frame.words.size(); ++i) {
    Row row = source_row(frame, i, charset);
    row.cells.resize(table.columns.size());
    if (matches(filter, {row.name})) table.rows.push_back(std::move(row));
  }
  return table;
}

Table takeovers_table(const std::vector<const Takeover*>& takeovers, bool is_tapped,
                      const std::string& filter, Charset charset) {
  Table table;
  const std::string arrow = charset == Charset::kUtf8 ? " → " : " -> ";
  table.columns = {
      {"CHANGE", 12, Align::kLeft, 0, false},
      {"AT", 0, Align::kLeft, 0, false, 15},
      {"WINNER", 0, Align::kLeft, 0, false, 27},
      {is_tapped ? "BECAUSE" : "BECAUSE (10 ms looks)", 0, Align::kLeft, 1, false, 22}};
  for (const Takeover* each : takeovers) {
    if (!matches(filter, {each->port, each->before, each->winner})) continue;
    table.rows.push_back({std::to_string(each->number),
                          {{clock_text(each->wall)},
                           name_cell(each->port),
                           change_cell(*each, arrow),
                           {each->because, Style::kPlain, 0, names_in(each->because)}}});
  }
  return table;
}

std::string clock_text(std::chrono::system_clock::time_point time) {
  const std::time_t seconds = std::chrono::system_clock::to_time_t(time);
  const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(time.time_since_epoch());
  std::tm local{};
  ::localtime_r(&seconds, &local);
  char text[64];
  std::snprintf(text, sizeof text, "%02d:%02d:%02d.%03d", local.tm_hour, local.tm_min, local.tm_sec,
                static_cast<int>(ms.count() % 1000));
  return text;
}

}  // namespace arbiter::top
