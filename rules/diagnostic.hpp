// What reading and checking a model finds, each with its place in a file.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace arbiter::rules {

struct Location {
  std::string file;
  std::uint32_t line = 1;    // from 1
  std::uint32_t column = 1;  // from 1, in bytes

  friend bool operator==(const Location&, const Location&) = default;
};

enum class Severity { kError, kWarning, kNote };

// An activation of sources that shows a finding: these are active, these are not, the others do not
// matter. Names in byte order.
struct Witness {
  std::vector<std::string> active;
  std::vector<std::string> inactive;
};

struct Diagnostic {
  Severity severity = Severity::kError;
  std::string code;  // stable, kebab-case: "both-can-win"
  Location where;
  std::string message;  // what is wrong, and behind the last "; " what to do
  std::optional<Witness> witness;
  std::vector<Witness> more_witnesses;  // of the same, each for itself
};

class Diagnostics {
 public:
  // Nobody reads more, and a large file of nothing but mistakes must not fill the memory.
  static constexpr std::size_t kMaxItems = 10'000;

  void error(std::string code, Location where, std::string message,
             std::optional<Witness> witness = {}) {
    has_errors_ = true;
    add(Severity::kError, std::move(code), std::move(where), std::move(message),
        std::move(witness));
  }
  void warning(std::string code, Location where, std::string message) {
    add(Severity::kWarning, std::move(code), std::move(where), std::move(message), {});
  }
  void note(std::string code, Location where, std::string message,
            std::optional<Witness> witness = {}, std::vector<Witness> more_witnesses = {}) {
    add(Severity::kNote, std::move(code), std::move(where), std::move(message), std::move(witness),
        std::move(more_witnesses));
  }
  // Without those of these codes; errors stay.
  void silence(const std::vector<std::string>& codes);

  [[nodiscard]] bool has_errors() const { return has_errors_; }
  [[nodiscard]] const std::vector<Diagnostic>& items() const { return items_; }
  // How many came after the first kMaxItems and were not kept.
  [[nodiscard]] std::size_t dropped() const { return dropped_; }

 private:
  // Control characters in the message are made visible.
  void add(Severity severity, std::string code, Location where, std::string message,
           std::optional<Witness> witness, std::vector<Witness> more_witnesses = {});

  std::vector<Diagnostic> items_;
  std::size_t dropped_ = 0;
  bool has_errors_ = false;
};

}  // namespace arbiter::rules
