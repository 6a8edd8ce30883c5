#include "top/view.hpp"

#include <algorithm>
#include <utility>

#include "watch/pace.hpp"

namespace arbiter::top {
namespace {

constexpr std::ptrdiff_t kFar = 10;  // pictures
constexpr const char* kChangesAreSorted = "changes are always shown with the newest first";

std::string title_of(const WhyQuestion& question) {
  std::string title = "Why";
  if (question.ports.size() == 1) title += " " + question.ports.front();
  if (!question.source.empty()) title += " " + question.source;
  title += question.moment == nullptr ? ", now" : ", at " + clock_text(question.moment->wall);
  return title + "   (Esc or q closes)";
}

// The models of two memories may have the same number.
bool has_model_of(const Frame& one, const Frame& other) {
  return one.memories == other.memories && one.generation == other.generation;
}

}  // namespace

Table View::table(Pane pane) const {
  const auto frame = history_.frame();
  if (frame == nullptr) return {};
  Table table;
  if (pane == Pane::kTakeovers) {
    return takeovers_table(history_.takeovers(), is_any_tapped(*frame), filter_, charset_);
  }
  table = pane == Pane::kPorts ? ports_table(*frame, filter_, charset_)
                               : sources_table(*frame, filter_, charset_);
  const PaneState& state = panes_[static_cast<std::size_t>(pane)];
  table.sort(std::min(state.sorted, table.columns.size() - 1), state.is_descending);
  return table;
}

// What is new is more important than what the last key did.
void View::set_problem(std::string problem) {
  if (problem != problem_) notice_.clear();
  problem_ = std::move(problem);
}

std::optional<WhyQuestion> View::press(const KeyPress& press) {
  notice_.clear();
  if (is_typing_) {
    type(press);
    return std::nullopt;
  }
  const Command command = command_of(press);
  if (overlay_) {
    obey_in_overlay(command);
    return std::nullopt;
  }
  return obey(command);
}

void View::type(const KeyPress& press) {
  if (press.key == Key::kCharacter) {
    if (filter_.size() < 200) filter_ += press.character;
  } else if (press.key == Key::kBackspace) {
    while (!filter_.empty() && (static_cast<unsigned char>(filter_.back()) & 0xc0) == 0x80) {
      filter_.pop_back();
    }
    if (!filter_.empty()) filter_.pop_back();
  } else {
    is_typing_ = false;
    if (press.key == Key::kEscape) filter_.clear();
  }
}

std::optional<WhyQuestion> View::obey(Command command) {
  const auto page = static_cast<std::ptrdiff_t>(state().page);
  constexpr std::ptrdiff_t kAll = 1'000'000;
  switch (command) {
    case Command::kQuit:
      is_over_ = true;
      break;
    case Command::kUp:
    case Command::kDown:
      move(command == Command::kUp ? -1 : 1);
      break;
    case Command::kPageUp:
    case Command::kPageDown:
      move(command == Command::kPageUp ? -page : page);
      break;
    case Command::kTop:
    case Command::kBottom:
      move(command == Command::kTop ? -kAll : kAll);
      break;
    case Command::kNextPane:
    case Command::kPreviousPane:
      move_focus(command == Command::kNextPane ? 1 : kPanes - 1);
      break;
    case Command::kSort:
      sort_by_next();
      break;
    case Command::kReverse:
      reverse();
      break;
    case Command::kFilter:
      is_typing_ = true;
      break;
    case Command::kPause:
      history_.is_paused() ? history_.resume() : history_.pause();
      break;
    case Command::kBack:
    case Command::kForward:
      step(command == Command::kBack ? -1 : 1);
      break;
    case Command::kBackFar:
    case Command::kForwardFar:
      step(command == Command::kBackFar ? -kFar : kFar);
      break;
    case Command::kWhy:
      return ask_why();
    case Command::kTap:
      toggle_tap();
      break;
    case Command::kHelp:
      overlay_.emplace("Keys and columns   (Esc or q closes)", help_lines());
      break;
    case Command::kEscape:
      filter_.clear();
      break;
    case Command::kNone:
      notice_ = "this key does nothing here; ? shows the keys";
      break;
  }
  return std::nullopt;
}

void View::obey_in_overlay(Command command) {
  const auto page = static_cast<std::ptrdiff_t>(overlay_->page());
  switch (command) {
    case Command::kUp:
    case Command::kDown:
      overlay_->scroll(command == Command::kUp ? -1 : 1);
      break;
    case Command::kPause:  // as a pager has it
    case Command::kPageDown:
      overlay_->scroll(page);
      break;
    case Command::kPageUp:
      overlay_->scroll(-page);
      break;
    case Command::kTop:
    case Command::kBottom:
      overlay_->scroll(command == Command::kTop ? -1'000'000 : 1'000'000);
      break;
    case Command::kQuit:
    case Command::kEscape:
    case Command::kWhy:
    case Command::kHelp:
      overlay_.reset();
      asked_.reset();
      break;
    default:
      break;
  }
}

void View::find_selected(Pane pane, const Table& table) {
  PaneState& state = panes_[static_cast<std::size_t>(pane)];
  if (table.rows.empty()) {
    state.index = 0;
    return;
  }
  const auto found = std::find_if(table.rows.begin(), table.rows.end(),
                                  [&](const Row& row) { return row.name == state.selected; });
  if (state.selected.empty()) {
    state.index = 0;
  } else if (found != table.rows.end()) {
    state.index = static_cast<std::size_t>(found - table.rows.begin());
  } else {
    state.index = std::min(state.index, table.rows.size() - 1);
  }
}

// The cursor stays on its row where that moves; at the top of the changes it stays at the newest.
void View::move(std::ptrdiff_t by) {
  const Table table = this->table(focus_);
  if (table.rows.empty()) return;
  find_selected(focus_, table);
  const auto last = static_cast<std::ptrdiff_t>(table.rows.size()) - 1;
  const auto to =
      std::clamp<std::ptrdiff_t>(static_cast<std::ptrdiff_t>(state().index) + by, 0, last);
  state().index = static_cast<std::size_t>(to);
  const bool is_newest = focus_ == Pane::kTakeovers && to == 0;
  state().selected = is_newest ? "" : table.rows[state().index].name;
}

void View::move_focus(int by) {
  focus_ = static_cast<Pane>((static_cast<int>(focus_) + by) % kPanes);
}

void View::step(std::ptrdiff_t by) {
  const auto before = history_.frame();
  history_.step(by);
  if (history_.frame() != before) return;
  notice_ = by < 0 ? "no older picture is kept"
                   : "no newer picture before the pause; Space goes on from now";
}

// Numbers begin with the largest. A column that the screen has no room for is passed over, for
// nobody would see what the rows are sorted by.
void View::sort_by_next() {
  if (focus_ == Pane::kTakeovers) {
    notice_ = kChangesAreSorted;
    return;
  }
  const Table table = this->table(focus_);
  if (table.columns.empty()) return;
  PaneState& state = this->state();
  const auto is_shown = [&](std::size_t column) {
    return state.widths.size() != table.columns.size() || state.widths[column] != 0;
  };
  do {
    state.sorted = (state.sorted + 1) % table.columns.size();
  } while (state.sorted != 0 && !is_shown(state.sorted));
  state.is_descending = table.columns[state.sorted].is_number;
}

void View::reverse() {
  if (focus_ == Pane::kTakeovers) {
    notice_ = kChangesAreSorted;
  } else {
    state().is_descending = !state().is_descending;
  }
}

void View::toggle_tap() {
  const Table table = this->table(focus_);
  if (focus_ == Pane::kSources) {
    notice_ = "a source cannot be tapped, input ports can: Tab goes to them";
    return;
  }
  if (table.rows.empty()) {
    notice_ = "there is no port here to tap";
    return;
  }
  find_selected(focus_, table);
  const Row& row = table.rows[state().index];
  const std::string& port = focus_ == Pane::kPorts ? row.name : row.cells[1].text;
  if (tapped_.count(port) == 0 && !history_.latest()->has_daemon) {
    notice_ = "a port can be tapped while a daemon runs, and none does now";
    return;
  }
  if (tapped_.erase(port) == 0) tapped_.insert(port);
  if (history_.is_paused()) {
    notice_ = (tapped_.count(port) != 0 ? "from now on tapped: " : "not tapped any more: ") + port +
              "; to be seen once you go on (Space)";
  }
}

std::optional<WhyQuestion> View::ask_why() {
  const Table table = this->table(focus_);
  const auto frame = history_.frame();
  if (table.rows.empty() || frame == nullptr) {
    notice_ = "there is nothing here to ask about";
    return std::nullopt;
  }
  find_selected(focus_, table);
  const Row& row = table.rows[state().index];
  WhyQuestion question;
  if (focus_ == Pane::kPorts) {
    question.ports = {row.name};
  } else if (focus_ == Pane::kTakeovers) {
    question.ports = {row.cells[1].text};
  } else {
    question.source = row.name;
    const auto place = frame->census->find_source(row.name);
    if (place >= 0) question.ports = frame->census->sources[static_cast<std::size_t>(place)].ports;
  }
  if (history_.is_paused()) {
    if (has_model_of(*frame, *history_.latest())) {
      question.moment = frame;
    } else {
      notice_ = "the answer is of now: another model is in force than in the picture shown";
    }
  }
  question.seen = seen_at(question.ports);
  if (!question.source.empty()) add_slowness(question.source, question.seen);
  asked_ = question;
  if (question.ports.empty()) {
    set_answer({question, {"No port is connected to " + row.name + ", and no rule reads it."}});
    return std::nullopt;
  }
  overlay_.emplace(title_of(question), std::vector<std::string>{"asking the daemon ..."});
  return question;
}

// The rules know a winner's past only from the last arrivals; this screen may have watched it for
// longer.
std::vector<std::string> View::seen_at(const std::vector<std::string>& ports) const {
  const Frame& frame = *history_.frame();
  std::vector<std::string> lines;
  for (const std::string& port : ports) {
    const auto place = frame.census->find_port(port);
    if (place < 0) continue;
    const PortState& state = frame.ports[static_cast<std::size_t>(place)];
    if (state.winner < kNobody || state.since == 0) continue;
    const std::string who =
        state.winner == kNobody
            ? "nobody"
            : frame.census->sources[static_cast<std::size_t>(state.winner)].name;
    std::string line = "  ";
    line += port;
    line += ": ";
    line += who;
    line += state.is_exact ? " has won for " : " has won for at least ";
    line += span(frame.now - state.since);
    for (const Takeover* each : history_.takeovers()) {
      if (each->port != port) continue;
      line += ", since " + clock_text(each->wall) + ": " + each->because;
      break;
    }
    lines.push_back(std::move(line));
  }
  return lines;
}

void View::add_slowness(const std::string& source, std::vector<std::string>& seen) const {
  const Frame& frame = *history_.frame();
  const auto place = frame.census->find_source(source);
  if (place < 0) return;
  const auto index = static_cast<std::size_t>(place);
  const shm::Nanoseconds period = frame.slow_period(index);
  if (period == 0) return;
  seen.push_back("  ! " + watch::slow_text(source, period, frame.census->sources[index].timeout));
}

void View::set_answer(const WhyReply& answer) {
  const bool is_wanted = asked_ && asked_->ports == answer.question.ports &&
                         asked_->source == answer.question.source &&
                         asked_->moment == answer.question.moment;
  if (!is_wanted) return;
  std::vector<std::string> lines = answer.lines;
  if (!asked_->seen.empty()) {
    lines.insert(lines.end(), {"", "What this screen had seen when you asked:"});
    lines.insert(lines.end(), asked_->seen.begin(), asked_->seen.end());
  }
  overlay_.emplace(title_of(answer.question), std::move(lines));
}

}  // namespace arbiter::top
