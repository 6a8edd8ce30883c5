// A program in a terminal of its own, which libvterm emulates: what is on the screen, cell by cell.
#pragma once

#include <poll.h>
#include <pty.h>
#include <signal.h>
#include <sys/ioctl.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <termios.h>
#include <unistd.h>
#include <utmp.h>
#include <vterm.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <functional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "shm/file_descriptor.hpp"
#include "shm/utf8.hpp"
#include "tests/support/child_process.hpp"

namespace arbiter::test {

class EmulatedTerminal {
 public:
  struct Size {
    int rows = 24;
    int columns = 80;
  };

  // `changes`: to the environment; TERM says what the emulator is taken for.
  EmulatedTerminal(const std::vector<std::string>& argv, const Environment& changes, Size size)
      : size_(size), vterm_(vterm_new(size.rows, size.columns)) {
    vterm_set_utf8(vterm_, 1);
    screen_ = vterm_obtain_screen(vterm_);
    static const VTermScreenCallbacks kCallbacks = callbacks();
    vterm_screen_set_callbacks(screen_, &kCallbacks, this);
    vterm_screen_enable_altscreen(screen_, 1);
    vterm_screen_reset(screen_, 1);
    int master = -1;
    int slave = -1;
    winsize window = kernel_size();
    if (::openpty(&master, &slave, nullptr, nullptr, &window) != 0) {
      throw std::runtime_error("openpty");
    }
    terminal_.reset(master);
    slave_.reset(slave);
    ::tcgetattr(slave, &settings_before_);
    start(argv, changes);
  }
  ~EmulatedTerminal() {
    if (child_ > 0) {
      ::kill(child_, SIGKILL);
      wait_for_end();
    }
    vterm_free(vterm_);
  }
  EmulatedTerminal(const EmulatedTerminal&) = delete;
  EmulatedTerminal& operator=(const EmulatedTerminal&) = delete;

  void type(std::string_view keys) const {
    if (::write(terminal_.get(), keys.data(), keys.size()) < 0) throw std::runtime_error("write");
  }
  void send(int signal) const { ::kill(child_, signal); }
  [[nodiscard]] pid_t pid() const { return child_; }
  // The kernel tells the program.
  void resize(Size size) {
    size_ = size;
    vterm_set_size(vterm_, size.rows, size.columns);
    const winsize window = kernel_size();
    ::ioctl(terminal_.get(), TIOCSWINSZ, &window);
  }

  // Tells the program that the terminal has another size than it has.
  void claim(Size size) const {
    winsize window{};
    window.ws_row = static_cast<unsigned short>(size.rows);
    window.ws_col = static_cast<unsigned short>(size.columns);
    ::ioctl(terminal_.get(), TIOCSWINSZ, &window);
  }

  // True once it holds of the screen; false if it does not in time, or the program has ended.
  bool wait_until(const std::function<bool()>& holds) {
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(30);
    while (!holds()) {
      const auto left =
          std::chrono::ceil<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now());
      pollfd ready[] = {{terminal_.get(), POLLIN, 0}, {process_.get(), POLLIN, 0}};
      if (left.count() <= 0 || ::poll(ready, 2, static_cast<int>(left.count())) <= 0) return false;
      if (!show() && ready[1].revents != 0) return holds();
    }
    return true;
  }
  bool wait_for(const std::string& text) {
    return wait_until([&] { return shows(text); });
  }
  bool wait_for_none(const std::string& text) {
    return wait_until([&] { return !shows(text); });
  }
  // 128 and the signal's number if a signal ended it.
  int wait_for_end() {
    wait_until([] { return false; });
    int status = 0;
    while (::waitpid(child_, &status, 0) < 0 && errno == EINTR) {
    }
    child_ = -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }

  [[nodiscard]] Size size() const { return size_; }
  [[nodiscard]] VTermScreenCell cell(int row, int column) const {
    VTermScreenCell result{};
    vterm_screen_get_cell(screen_, {row, column}, &result);
    return result;
  }
  [[nodiscard]] std::string row(int number) const {
    std::string text;
    for (int column = 0; column < size_.columns;) {
      const VTermScreenCell each = cell(number, column);
      text += each.chars[0] == 0 ? " " : shm::encode_utf8(each.chars[0]);
      column += each.width > 1 ? each.width : 1;
    }
    text.erase(text.find_last_not_of(' ') + 1);
    return text;
  }
  [[nodiscard]] std::string text() const {
    std::string all;
    for (int i = 0; i < size_.rows; ++i) all += row(i) + "\n";
    return all;
  }
  [[nodiscard]] bool shows(const std::string& what) const {
    return text().find(what) != std::string::npos;
  }
  // The first row that has this text in it; -1: none has.
  [[nodiscard]] int row_with(const std::string& what) const {
    for (int i = 0; i < size_.rows; ++i) {
      if (row(i).find(what) != std::string::npos) return i;
    }
    return -1;
  }
  [[nodiscard]] bool is_coloured() const {
    for (int i = 0; i < size_.rows; ++i) {
      for (int k = 0; k < size_.columns; ++k) {
        const VTermScreenCell each = cell(i, k);
        if (!VTERM_COLOR_IS_DEFAULT_FG(&each.fg) || !VTERM_COLOR_IS_DEFAULT_BG(&each.bg)) {
          return true;
        }
      }
    }
    return false;
  }
  [[nodiscard]] bool is_alternate() const { return is_alternate_; }
  [[nodiscard]] bool has_cursor() const { return has_cursor_; }
  // Echo, line editing and the like are as they were before the program came.
  [[nodiscard]] bool is_restored() const {
    termios now{};
    ::tcgetattr(slave_.get(), &now);
    return now.c_lflag == settings_before_.c_lflag && now.c_iflag == settings_before_.c_iflag &&
           now.c_oflag == settings_before_.c_oflag && !is_alternate_ && has_cursor_;
  }
  // All that the program wrote.
  [[nodiscard]] const std::string& written() const { return written_; }

 private:
  static VTermScreenCallbacks callbacks() {
    VTermScreenCallbacks result{};
    result.settermprop = [](VTermProp property, VTermValue* value, void* self) {
      auto& terminal = *static_cast<EmulatedTerminal*>(self);
      if (property == VTERM_PROP_ALTSCREEN) terminal.is_alternate_ = value->boolean != 0;
      if (property == VTERM_PROP_CURSORVISIBLE) terminal.has_cursor_ = value->boolean != 0;
      return 1;
    };
    return result;
  }
  [[nodiscard]] winsize kernel_size() const {
    winsize size{};
    size.ws_row = static_cast<unsigned short>(size_.rows);
    size.ws_col = static_cast<unsigned short>(size_.columns);
    return size;
  }

  void start(const std::vector<std::string>& argv, const Environment& changes) {
    std::vector<char*> arguments;
    for (const auto& argument : argv) arguments.push_back(const_cast<char*>(argument.c_str()));
    arguments.push_back(nullptr);
    child_ = ::fork();
    if (child_ < 0) throw std::runtime_error("fork");
    if (child_ == 0) {
      ::prctl(PR_SET_PDEATHSIG, SIGKILL);
      for (const auto& [name, value] : changes) {
        value ? ::setenv(name.c_str(), value->c_str(), 1) : ::unsetenv(name.c_str());
      }
      if (::login_tty(slave_.get()) != 0) ::_exit(126);
      ::execv(arguments[0], arguments.data());
      ::_exit(127);
    }
    process_.reset(static_cast<int>(::syscall(SYS_pidfd_open, child_, 0)));
  }

  // False: there was nothing.
  bool show() {
    std::array<char, 16384> buffer;
    pollfd ready{terminal_.get(), POLLIN, 0};
    if (::poll(&ready, 1, 0) <= 0) return false;
    const ssize_t count = ::read(terminal_.get(), buffer.data(), buffer.size());
    if (count <= 0) return false;
    written_.append(buffer.data(), static_cast<std::size_t>(count));
    vterm_input_write(vterm_, buffer.data(), static_cast<std::size_t>(count));
    vterm_screen_flush_damage(screen_);
    return true;
  }

  Size size_;
  VTerm* const vterm_;
  VTermScreen* screen_ = nullptr;
  shm::FileDescriptor terminal_;
  shm::FileDescriptor slave_;  // kept, so that the terminal outlives the program
  termios settings_before_{};
  pid_t child_ = -1;
  shm::FileDescriptor process_;
  std::string written_;
  bool is_alternate_ = false;
  bool has_cursor_ = true;
};

}  // namespace arbiter::test
