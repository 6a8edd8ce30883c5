// The view as lines.
#include <algorithm>
#include <iterator>
#include <string>
#include <utility>

#include "top/view.hpp"

namespace arbiter::top {
namespace {

// Below this the tables would be too short to be of use: one is shown at a time.
constexpr std::size_t kRowsForAll = 13;

// Left and right in one line; where both do not fit, the right one stays.
Line two_sided(const std::string& left, const std::string& right, std::size_t columns, Style style,
               Style right_style, Charset charset) {
  const std::size_t wanted = std::min(columns_of(safe(right, charset)), columns);
  Line line;
  line.spans = {{fit(left, columns - wanted, Align::kLeft, charset), style},
                {fit(right, wanted, Align::kLeft, charset), right_style}};
  return line;
}

// In as many lines as it needs, of which it gets a quarter of the screen: what to do about it comes
// last.
std::vector<Line> message(const std::string& text, Size size, Style style, Charset charset) {
  std::vector<std::string> parts = broken(text, size.columns, charset);
  const std::size_t most = std::max<std::size_t>(size.rows / 4, 1);
  if (parts.size() > most) {
    parts[most - 1] += parts[most];  // is cut, with a mark
    parts.resize(most);
  }
  std::vector<Line> lines;
  lines.reserve(parts.size());
  for (const std::string& part : parts) {
    lines.push_back(line_of(part, size.columns, style, charset));
  }
  return lines;
}

// And blanks behind it, up to the edge.
Line with_margin(const std::string& margin, Line line, std::size_t columns) {
  line.spans.insert(line.spans.begin(), {margin, Style::kPlain});
  std::size_t width = 0;
  for (const Span& span : line.spans) width += columns_of(span.text);
  if (width < columns) line.spans.push_back({std::string(columns - width, ' ')});
  return line;
}

}  // namespace

std::vector<Line> View::draw(Size size) {
  std::vector<Line> lines;
  if (size.rows == 0 || size.columns == 0) return lines;
  lines.push_back(title(size.columns));
  std::vector<Line> footer = this->footer(size);
  const std::size_t around = 1 + footer.size();
  const std::size_t body = size.rows > around ? size.rows - around : 0;
  if (overlay_) {
    for (Line& line : overlay_->draw(size.columns, body, charset_))
      lines.push_back(std::move(line));
  } else if (history_.frame() == nullptr) {
    lines.push_back(line_of("asking the daemon ...", size.columns, Style::kDim, charset_));
  } else {
    take_up_names(history_.frame()->census);
    std::array<Table, kPanes> tables = {table(Pane::kPorts), table(Pane::kSources),
                                        table(Pane::kTakeovers)};
    const auto heights = this->heights(tables, body);
    for (std::size_t i = 0; i < tables.size(); ++i) {
      const Size room{size.columns, heights[i]};
      for (Line& line : draw_pane(static_cast<Pane>(i), std::move(tables[i]), room)) {
        lines.push_back(std::move(line));
      }
    }
  }
  const std::size_t above = size.rows - footer.size();
  lines.resize(std::min(lines.size(), above));
  while (lines.size() < above) {
    lines.push_back(line_of("", size.columns, Style::kPlain, charset_));
  }
  std::move(footer.begin(), footer.end(), std::back_inserter(lines));
  return lines;
}

void View::take_up_names(const std::shared_ptr<const Census>& census) {
  if (named_ == census) return;
  named_ = census;
  std::vector<std::string> names;
  for (const PortFact& each : census->ports) names.push_back(each.name);
  for (const SourceFact& each : census->sources) names.push_back(each.name);
  names_.set(std::move(names));
}

// A header each. Changes get a quarter; ports and sources what they need, and where that is too
// much, ports at least half of it.
std::array<std::size_t, kPanes> View::heights(const std::array<Table, kPanes>& tables,
                                              std::size_t rows) const {
  std::array<std::size_t, kPanes> result{};
  if (rows < kRowsForAll) {
    result[static_cast<std::size_t>(focus_)] = rows;
    return result;
  }
  const std::size_t ports = tables[0].rows.size() + 1;
  const std::size_t sources = tables[1].rows.size() + 1;
  const std::size_t changes = std::max<std::size_t>(rows / 4, 4);
  const std::size_t room = rows - changes;
  result[0] = std::min(ports, std::max(room / 2, room - std::min(sources, room)));
  result[1] = std::min(sources, room - result[0]);
  result[2] = rows - result[0] - result[1];
  return result;
}

// So that the cursor is among them. Returns where the rows that are shown end.
std::size_t View::scroll_to_cursor(Pane pane, const Table& table, std::size_t rows) {
  find_selected(pane, table);
  PaneState& state = panes_[static_cast<std::size_t>(pane)];
  state.page = std::max<std::size_t>(rows - 1, 1);
  const std::size_t most = table.rows.size() > state.page ? table.rows.size() - state.page : 0;
  state.offset = std::min({state.offset, state.index, most});
  if (state.index >= state.offset + state.page) state.offset = state.index - state.page + 1;
  return std::min(state.offset + state.page, table.rows.size());
}

Line View::pane_header(Pane pane, const Table& table) const {
  const PaneState& state = panes_[static_cast<std::size_t>(pane)];
  const std::size_t none = table.columns.size();
  const std::size_t sorted = pane == Pane::kTakeovers ? none : std::min(state.sorted, none - 1);
  Line header = table.header(state.widths, sorted, state.is_descending, charset_);
  for (Span& span : header.spans) span.style = pane == focus_ ? Style::kTitle : Style::kHeader;
  return header;
}

std::vector<Line> View::draw_pane(Pane pane, Table table, Size size) {
  std::vector<Line> lines;
  if (size.rows == 0 || table.columns.empty()) return lines;
  const std::size_t end = scroll_to_cursor(pane, table, size.rows);
  PaneState& state = panes_[static_cast<std::size_t>(pane)];
  if (end - state.offset < table.rows.size()) {
    table.columns[pane == Pane::kTakeovers ? 1 : 0].title +=
        " " + std::to_string(state.offset + 1) + "-" + std::to_string(end) + "/" +
        std::to_string(table.rows.size());
  }
  // Before the columns, so that no name is so long that it hides them.
  const bool has_marks =
      size.columns > 16 && std::any_of(table.rows.begin(), table.rows.end(),
                                       [](const Row& row) { return row.is_marked; });
  const auto margin = [&](bool has_cursor, bool is_tapped) {
    const std::string marks = has_marks ? (is_tapped ? "t " : "  ") : "";
    return (has_cursor ? ">" : " ") + marks;
  };
  const std::size_t gutter = margin(false, false).size();
  state.widths = table.widths(size.columns > gutter + 1 ? size.columns - gutter : 1, charset_);
  const bool has_focus = pane == focus_;
  lines.push_back(with_margin(margin(has_focus, false), pane_header(pane, table), size.columns));
  for (std::size_t i = state.offset; i < end; ++i) {
    const bool is_selected = has_focus && i == state.index;
    const Row& row = table.rows[i];
    lines.push_back(with_margin(margin(is_selected, row.is_marked),
                                table.line(row, state.widths, is_selected, charset_, &names_),
                                size.columns));
    lines.back().is_selected = is_selected;
  }
  if (table.rows.empty() && size.rows > 1) {
    lines.push_back(line_of(filter_.empty() ? "   none" : "   none that the filter shows",
                            size.columns, Style::kDim, charset_));
  }
  while (lines.size() < size.rows) {
    lines.push_back(line_of("", size.columns, Style::kPlain, charset_));
  }
  return lines;
}

Line View::title(std::size_t columns) const {
  const auto frame = history_.frame();
  if (frame == nullptr) return line_of("arbiter top", columns, Style::kTitle, charset_);
  const std::string left = "arbiter top  " + frame->census->instance + "  " + frame->census->model +
                           "  " + clock_text(frame->wall);
  if (history_.is_paused()) {
    const shm::Nanoseconds age = history_.age();
    return two_sided(left, age == 0 ? "  PAUSED" : "  PAUSED, " + span(age) + " back", columns,
                     Style::kTitle, Style::kWarning, charset_);
  }
  if (!frame->has_daemon) {
    return two_sided(left, "  NO DAEMON: the last model decides", columns, Style::kTitle,
                     Style::kWarning, charset_);
  }
  if (is_silent_) {
    return two_sided(left, "  NO ANSWER from the daemon", columns, Style::kTitle, Style::kWarning,
                     charset_);
  }
  if (const std::size_t strangers = frame->census->strangers; strangers != 0) {
    const std::string who =
        std::to_string(strangers) + (strangers == 1 ? " component" : " components");
    return two_sided(left, "  " + who + " unknown: see arbiter status", columns, Style::kTitle,
                     Style::kWarning, charset_);
  }
  return two_sided(left, "  live", columns, Style::kTitle, Style::kTitle, charset_);
}

std::vector<Line> View::footer(Size size) const {
  const std::size_t columns = size.columns;
  if (is_typing_) return {line_of("filter: " + filter_ + "_", columns, Style::kTitle, charset_)};
  if (!notice_.empty()) return message(notice_, size, Style::kTitle, charset_);
  const auto frame = history_.frame();
  if (frame != nullptr && frame->has_daemon && !problem_.empty() && !history_.is_paused()) {
    return message(problem_, size, Style::kWarning, charset_);
  }
  if (frame != nullptr && !frame->is_settled) {
    return message("sources change too fast for one picture: who wins may be late", size,
                   Style::kWarning, charset_);
  }
  std::string keys = overlay_ ? "Esc or q close  arrows scroll"
                              : "q quit  ? help  Enter why  t tap  Tab pane  / filter  s sort  "
                                "Space pause";
  if (!filter_.empty()) keys = "filter \"" + filter_ + "\": Esc shows all   " + keys;
  return {line_of(keys, columns, Style::kDim, charset_)};
}

std::string View::text() const {
  const auto frame = history_.frame();
  if (frame == nullptr) return "";
  std::string text = "instance " + frame->census->instance + ", " + frame->census->model + ", " +
                     clock_text(frame->wall) + "\n";
  for (const Pane pane : {Pane::kPorts, Pane::kSources, Pane::kTakeovers}) {
    const Table table = this->table(pane);
    if (pane == Pane::kTakeovers && table.rows.empty()) continue;
    const auto widths = table.widths(100'000, charset_);
    text += "\n" +
            safe(table.header(widths, table.columns.size(), false, charset_).text(), charset_) +
            "\n";
    for (const Row& row : table.rows) {
      text += table.line(row, widths, false, charset_).text() + "\n";
    }
  }
  return text;
}

}  // namespace arbiter::top
