#include "top/view.hpp"

#include <algorithm>
#include <utility>

namespace arbiter::top {
namespace {

constexpr std::ptrdiff_t kFar = 10;  // pictures

std::string title_of(const WhyQuestion& question) {
  std::string title = "Why";
  if (question.ports.size() == 1) title += " " + question.ports.front();
  if (!question.source.empty()) title += " " + question.source;
  return title + ", now   (Esc closes)";
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

std::optional<WhyQuestion> View::press(const KeyPress& press) {
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
      state().is_descending = !state().is_descending;
      break;
    case Command::kFilter:
      is_typing_ = true;
      break;
    case Command::kPause:
      history_.is_paused() ? history_.resume() : history_.pause();
      break;
    case Command::kBack:
    case Command::kForward:
      history_.step(command == Command::kBack ? -1 : 1);
      break;
    case Command::kBackFar:
    case Command::kForwardFar:
      history_.step(command == Command::kBackFar ? -kFar : kFar);
      break;
    case Command::kWhy:
      return ask_why();
    case Command::kTap:
      toggle_tap();
      break;
    case Command::kHelp:
      overlay_.emplace("Keys and columns   (Esc closes)", help_lines());
      break;
    case Command::kEscape:
      filter_.clear();
      break;
    case Command::kNone:
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

// Numbers begin with the largest. Changes have an order of their own.
void View::sort_by_next() {
  const Table table = this->table(focus_);
  if (focus_ == Pane::kTakeovers || table.columns.empty()) return;
  PaneState& state = this->state();
  state.sorted = (state.sorted + 1) % table.columns.size();
  state.is_descending = table.columns[state.sorted].is_number;
}

void View::toggle_tap() {
  const Table table = this->table(focus_);
  if (focus_ == Pane::kSources || table.rows.empty()) return;
  find_selected(focus_, table);
  const Row& row = table.rows[state().index];
  const std::string& port = focus_ == Pane::kPorts ? row.name : row.cells[1].text;
  if (tapped_.erase(port) == 0) tapped_.insert(port);
}

std::optional<WhyQuestion> View::ask_why() {
  const Table table = this->table(focus_);
  const auto frame = history_.frame();
  if (table.rows.empty() || frame == nullptr) return std::nullopt;
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
  asked_ = question;
  if (question.ports.empty()) {
    set_answer({question, {"No port is connected to " + row.name + ", and no rule reads it."}});
    return std::nullopt;
  }
  overlay_.emplace(title_of(question), std::vector<std::string>{"asking the daemon ..."});
  return question;
}

void View::set_answer(const WhyAnswer& answer) {
  const bool is_wanted =
      asked_ && asked_->ports == answer.question.ports && asked_->source == answer.question.source;
  if (is_wanted) overlay_.emplace(title_of(answer.question), answer.lines);
}

}  // namespace arbiter::top
