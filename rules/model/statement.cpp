#include "rules/model/statement.hpp"

#include <optional>
#include <utility>

#include "rules/text/names.hpp"
#include "rules/text/text.hpp"

namespace arbiter::rules {
namespace {

// Without what stands behind a '#'.
std::string_view without_comment(std::string_view line) {
  bool quoted = false;
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (line[i] == '"') quoted = !quoted;
    if (line[i] == '#' && !quoted) return line.substr(0, i);
  }
  return line;
}

class StatementReader {
 public:
  StatementReader(const TextFile& file, Diagnostics& diagnostics)
      : file_(file), diagnostics_(diagnostics) {}

  std::vector<Statement> read() {
    if (!check_characters(file_, diagnostics_)) return {};
    std::string_view rest = file_.content();
    while (!rest.empty()) {
      const std::size_t end = std::min(rest.find('\n'), rest.size());
      take_line(rest.substr(0, end));
      rest.remove_prefix(std::min(end + 1, rest.size()));
    }
    finish();
    if (statements_.empty() && malformed_ == 0) {
      diagnostics_.error("no-statements", file_.locate(0),
                         "this file has no statement, so nothing would be proved; write one on "
                         "each line, or do not give the file");
    }
    return std::move(statements_);
  }
  [[nodiscard]] std::size_t malformed() const { return malformed_; }

 private:
  void take_line(std::string_view line) {
    const std::string_view content = without_comment(line);
    if (trim(content).empty()) return;
    const bool goes_on = text_ && (line[0] == ' ' || line[0] == '\t');
    const std::size_t at = file_.offset_of(content.data());
    if (goes_on) {
      text_->append_for("\n", at, 0);
    } else {
      finish();
      text_.emplace(file_, at);
    }
    text_->append(content, at);
  }

  void finish() {
    if (!text_) return;
    const Text text = *std::exchange(text_, std::nullopt);
    if (statements_.size() == kMaxStatements) {
      ++malformed_;
      if (!std::exchange(is_full_, true)) {
        diagnostics_.error("limit-exceeded", text.where(),
                           "from here on, there are more statements than the limit of " +
                               std::to_string(kMaxStatements) + "; use several files");
      }
      return;
    }
    auto parsed = parse_statement(text, diagnostics_);
    if (!parsed) {
      ++malformed_;
      return;
    }
    statements_.push_back({collapse_blanks(text.bytes()), text.where(), std::move(*parsed)});
  }

  const TextFile& file_;
  Diagnostics& diagnostics_;
  std::optional<Text> text_;
  bool is_full_ = false;
  std::size_t malformed_ = 0;  // or beyond the limit
  std::vector<Statement> statements_;
};

}  // namespace

std::vector<Statement> read_statements(const TextFile& file, Diagnostics& diagnostics,
                                       std::size_t* malformed) {
  StatementReader reader(file, diagnostics);
  auto statements = reader.read();
  if (malformed != nullptr) *malformed = reader.malformed();
  return statements;
}

}  // namespace arbiter::rules
