// Takes a condition apart into words and operators.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace arbiter::rules {

enum class TokenKind {
  kEnd,
  kPort,  // name: bare or quoted
  kTrue,
  kFalse,
  kNot,
  kAnd,
  kXor,
  kOr,
  kImplies,
  kIff,
  kAny,
  kAll,
  kNone,
  kOpen,
  kClose,
  kWinner,  // in statements only, as those that follow
  kIdle,
  kActive,
  kEquals,
  kDiffers,
};

// Statements (rules/model/statement.hpp) are conditions that may speak of winners, too.
enum class Language { kCondition, kStatement };

struct Token {
  TokenKind kind = TokenKind::kEnd;
  std::size_t at = 0;  // its first byte
  std::string_view spelling;
  std::string_view name;  // of a port, without quotes
};

// Where a condition is malformed; thrown by lexer and parser, caught by parse_condition().
struct ConditionError {
  std::size_t at;
  std::string message;
  std::string code = "malformed-condition";
};

class ConditionLexer {
 public:
  explicit ConditionLexer(std::string_view condition, Language language = Language::kCondition)
      : condition_(condition), language_(language) {
    advance();
  }

  [[nodiscard]] const Token& peek() const { return token_; }
  Token take();
  // The pattern of a quantifier, whose '(' is the token that peek() shows. Patterns have a '*' and
  // need not begin with '/', so that only here they can be told from other words. Ends behind it.
  Token take_glob();

 private:
  void advance();
  void skip_blanks();
  // Says of operators of other languages what to write for them.
  void reject_foreign_operator() const;
  [[nodiscard]] Token read_operator() const;
  [[nodiscard]] Token read_quoted() const;
  [[nodiscard]] Token read_word() const;
  // The bytes from here on that a bare name may have.
  [[nodiscard]] std::string_view bare_name(std::string_view more_characters) const;
  [[nodiscard]] std::string_view rest() const { return condition_.substr(next_); }

  std::string_view condition_;
  Language language_;
  std::size_t next_ = 0;
  Token token_;
};

}  // namespace arbiter::rules
