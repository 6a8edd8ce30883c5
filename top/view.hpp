// The model of the view: what is looked at, in which order, from where; and the screen as lines.
//
// Pure: it reads no clock, asks nobody and knows no terminal. Pictures and keys go in, lines come
// out.
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "top/frame.hpp"
#include "top/history.hpp"
#include "top/keys.hpp"
#include "top/line.hpp"
#include "top/overlay.hpp"
#include "top/panes.hpp"

namespace arbiter::top {

struct Size {
  std::size_t columns = 80;
  std::size_t rows = 24;
};

class View {
 public:
  View(Charset charset, std::size_t max_frames)
      : charset_(charset), names_(charset), history_(max_frames) {}

  void add(std::shared_ptr<const Frame> frame, std::vector<Takeover> takeovers) {
    history_.add(std::move(frame), std::move(takeovers));
  }
  // Why there is nothing new of what is asked of the daemon; "": there is.
  void set_problem(std::string problem);
  // The daemon is there and does not answer.
  void set_silent(bool is_silent) { is_silent_ = is_silent; }
  // Shown if it is what was asked for last and nobody has closed it.
  void set_answer(const WhyReply& answer);

  // What to ask, if anything.
  std::optional<WhyQuestion> press(const KeyPress& press);
  // The ports that are to be tapped.
  [[nodiscard]] const std::set<std::string>& tapped() const { return tapped_; }
  // It was refused: `t` asks for it again.
  void forget_tap(const std::string& port) { tapped_.erase(port); }
  [[nodiscard]] bool is_over() const { return is_over_; }

  // At most size.rows lines, each exactly size.columns wide.
  [[nodiscard]] std::vector<Line> draw(Size size);
  // All of it, as text: each table in full.
  [[nodiscard]] std::string text() const;

 private:
  struct PaneState {
    std::string selected;   // the row's name; "": the first one
    std::size_t index = 0;  // where it was when it was drawn last
    std::size_t offset = 0;
    std::size_t page = 1;
    std::size_t sorted = 0;
    bool is_descending = false;
    std::vector<std::size_t> widths;  // of the columns when they were drawn last
  };

  [[nodiscard]] PaneState& state() { return panes_[static_cast<std::size_t>(focus_)]; }
  [[nodiscard]] Table table(Pane pane) const;
  void type(const KeyPress& press);
  std::optional<WhyQuestion> obey(Command command);
  void obey_in_overlay(Command command);
  void toggle_tap();
  void move(std::ptrdiff_t by);
  void move_focus(int by);
  void step(std::ptrdiff_t by);
  void sort_by_next();
  void reverse();
  std::optional<WhyQuestion> ask_why();
  [[nodiscard]] std::vector<std::string> seen_at(const std::vector<std::string>& ports) const;
  // What the T of this source is marked for.
  void add_slowness(const std::string& source, std::vector<std::string>& seen) const;
  void find_selected(Pane pane, const Table& table);
  void take_up_names(const std::shared_ptr<const Census>& census);
  std::size_t scroll_to_cursor(Pane pane, const Table& table, std::size_t rows);
  [[nodiscard]] Line pane_header(Pane pane, const Table& table) const;
  [[nodiscard]] std::vector<Line> draw_pane(Pane pane, Table table, Size size);
  [[nodiscard]] std::array<std::size_t, kPanes> heights(const std::array<Table, kPanes>& tables,
                                                        std::size_t rows) const;
  [[nodiscard]] Line title(std::size_t columns) const;
  [[nodiscard]] std::vector<Line> footer(Size size) const;

  const Charset charset_;
  ShortNames names_;
  std::shared_ptr<const Census> named_;  // that names_ has the names of
  History history_;
  std::array<PaneState, kPanes> panes_;
  Pane focus_ = Pane::kPorts;
  std::string filter_;
  bool is_typing_ = false;  // the filter
  std::set<std::string> tapped_;
  std::string problem_;
  bool is_silent_ = false;
  std::string notice_;  // why the last key did nothing, or not what it seems to
  std::optional<Overlay> overlay_;
  std::optional<WhyQuestion> asked_;
  bool is_over_ = false;
};

}  // namespace arbiter::top
