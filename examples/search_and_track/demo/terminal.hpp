// The terminal, borrowed: another screen without a cursor, given back as it was.
#pragma once

#include <string_view>

namespace search_and_track {

class Terminal {
 public:
  // Whether there is one that can show pictures.
  [[nodiscard]] static bool is_there();

  Terminal();
  ~Terminal();
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;

  struct Size {
    int rows;
    int columns;
    bool operator==(const Size&) const = default;
  };
  // As it is now; also clears the screen when it is another than last time.
  [[nodiscard]] Size size();
  [[nodiscard]] bool is_coloured() const { return coloured_; }
  static void write(std::string_view text);

 private:
  bool coloured_;
  Size last_{0, 0};
};

}  // namespace search_and_track
