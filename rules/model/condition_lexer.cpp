#include "rules/model/condition_lexer.hpp"

#include <array>
#include <cctype>
#include <utility>
#include <vector>

#include "rules/text/names.hpp"
#include "shm/utf8.hpp"

namespace arbiter::rules {
namespace {

using Spelling = std::pair<std::string_view, TokenKind>;

// Those that others begin with come later.
constexpr std::array<Spelling, 15> kOperators{{
    {"<->", TokenKind::kIff},
    {"↔", TokenKind::kIff},
    {"->", TokenKind::kImplies},
    {"→", TokenKind::kImplies},
    {"||", TokenKind::kOr},
    {"|", TokenKind::kOr},
    {"∨", TokenKind::kOr},
    {"&&", TokenKind::kAnd},
    {"&", TokenKind::kAnd},
    {"∧", TokenKind::kAnd},
    {"!", TokenKind::kNot},
    {"~", TokenKind::kNot},
    {"¬", TokenKind::kNot},
    {"(", TokenKind::kOpen},
    {")", TokenKind::kClose},
}};

constexpr std::array<Spelling, 11> kWords{{
    {"iff", TokenKind::kIff},
    {"implies", TokenKind::kImplies},
    {"or", TokenKind::kOr},
    {"xor", TokenKind::kXor},
    {"and", TokenKind::kAnd},
    {"not", TokenKind::kNot},
    {"true", TokenKind::kTrue},
    {"false", TokenKind::kFalse},
    {"any", TokenKind::kAny},
    {"all", TokenKind::kAll},
    {"none", TokenKind::kNone},
}};

constexpr std::array<Spelling, 2> kComparisons{{
    {"!=", TokenKind::kDiffers},  // before "!" is looked for
    {"=", TokenKind::kEquals},
}};

constexpr std::array<Spelling, 3> kStatementWords{{
    {"winner", TokenKind::kWinner},
    {"idle", TokenKind::kIdle},
    {"active", TokenKind::kActive},
}};

// What other languages write, and what to write here. Those that others begin with come later.
struct Foreign {
  std::string_view spelling;
  std::string_view advice;
};

// Words, not what XML would take for a tag: whoever copies "<->" into a model is refused again.
constexpr auto kForeignOperators = std::to_array<Foreign>({
    {"<=>", "write iff"},
    {"=>", "write implies or ->"},
    {"<=", "write implies or ->, what follows behind it"},
    {"<-", "write implies or ->, what follows behind it"},
    {"⇒", "write implies or ->"},
    {"⇔", "write iff"},
    {"⊕", "write xor"},
    {"^", "write xor"},
    {"∀", "write all(/Nav/*)"},
    {"∃", "write any(/Nav/*)"},
    {"≠", "write xor between conditions, and != behind winner(…)"},
    {"<>", "write xor between conditions, and != behind winner(…)"},
});

// In a statement, the comparisons of winners mean something; "==" nowhere does.
constexpr std::string_view kDoubleEquals = "==";
constexpr auto kNoComparisons = std::to_array<Foreign>({
    {"!=", "write xor"},
    {"=",
     "write iff between conditions; /x alone says that /x is active, and \"not /x\" that "
     "it is not"},
});

// In a statement, where winners are compared; before the words below are looked for.
constexpr auto kForeignStatementWords = std::to_array<Foreign>({
    {"is", "write = behind winner(…); a source's name by itself says that it is active"},
    {"nobody", "write idle(/Arm/pos:i), or none behind winner(/Arm/pos:i) ="},
    {"wins", "write winner(/Arm/pos:i) = /Teleop/pos:o"},
    {"always", "a statement must be true in every state: write it alone"},
});

constexpr auto kForeignWords = std::to_array<Foreign>({
    {"active", "a source's name by itself says that it is active: write the name alone"},
    {"isactive", "a source's name by itself says that it is active: write the name alone"},
    {"is_active", "a source's name by itself says that it is active: write the name alone"},
    {"is", "a source's name by itself says that it is active: write the name alone"},
    {"inactive", "write not and the source's name"},
    {"exists", "write any(/Nav/*)"},
    {"some", "write any(/Nav/*)"},
    {"forall", "write all(/Nav/*)"},
    {"every", "write all(/Nav/*)"},
    {"no", "write none(/Nav/*) of several sources, and not of one"},
    {"if", "write implies or ->, and what must hold behind it, as in /Object/pos:o -> /Face/pos:o"},
    {"then", "write implies or ->, as in /Object/pos:o -> /Face/pos:o"},
    {"nor", "write and not"},
    {"nand", "write not (… and …)"},
    {"unless", "write and not (…) around all that follows"},
    {"never", "write not"},
    {"always", "a rule holds whenever it is true: write the condition alone"},
    {"equals", "write iff"},
    {"for", "how long a source stays active says the timeout of its <source>"},
    {"1", "write true"},
    {"0", "write false"},
    {"but", "write and"},
});

bool is_letter_or_digit(char byte) {
  return (byte >= 'a' && byte <= 'z') || (byte >= 'A' && byte <= 'Z') ||
         (byte >= '0' && byte <= '9');
}

[[noreturn]] void fail_at_word(std::size_t at, std::string_view word, Language language) {
  const std::string lower = lower_case(word.substr(0, word.find('/')));
  std::vector<std::string_view> known;
  std::vector<Spelling> words(kWords.begin(), kWords.end());
  if (language == Language::kStatement) {
    words.insert(words.end(), kStatementWords.begin(), kStatementWords.end());
  }
  const auto reject = [&](const auto& foreign) {
    for (const auto& [spelling, advice] : foreign) {
      if (spelling != lower) continue;
      throw ConditionError{at, quote(word) + " is no keyword here; " + std::string(advice)};
    }
  };
  if (language == Language::kStatement) reject(kForeignStatementWords);
  reject(kForeignWords);
  for (const auto& [spelling, kind] : kStatementWords) {
    if (spelling == lower && language == Language::kCondition) {
      throw ConditionError{at,
                           "a condition reads which sources are active, and not who wins; write "
                           "the sources' names, or put this into a statement for arbiter check "
                           "--assert"};
    }
  }
  for (const auto& [spelling, kind] : words) {
    if (spelling == lower) {
      throw ConditionError{at,
                           "keywords are in lower case; write " + lower + " for " + quote(word)};
    }
    known.push_back(spelling);
  }
  const std::string name = "/" + std::string(word);
  const bool is_like_name = word.find_first_of("/:") != std::string_view::npos;
  throw ConditionError{at, quote(word) + " is neither a keyword nor a port's name" +
                               advise(word, known,
                                      is_like_name ? "names begin with '/': write " + quote(name)
                                                   : "names begin with '/'")};
}

// What to do about a character that no name has without quotes.
std::string advice_on(char character) {
  switch (character) {
    case '*':
      return "where a pattern is meant, write any(/Nav/*), all(/Nav/*) or none(/Nav/*)";
    case '$':
      return "a define is used as ${name}";
    case ',':
      return "write and, or or, between two conditions, and a quantifier for each pattern: "
             "any(/Nav/*) or any(/Op/*)";
    default:
      return "remove it, or put the name that it belongs to in double quotes";
  }
}

}  // namespace

Token ConditionLexer::take() {
  const Token token = token_;
  advance();
  return token;
}

Token ConditionLexer::take_glob() {
  skip_blanks();
  Token glob{TokenKind::kPort, next_, {}, {}};
  if (rest().starts_with('"')) {
    glob = read_quoted();
  } else {
    glob.spelling = glob.name = bare_name("*");
    if (glob.name.empty()) {
      throw ConditionError{next_, "a pattern is expected here, such as /Face/* or \"/Face/*\""};
    }
  }
  next_ += glob.spelling.size();
  advance();
  return glob;
}

void ConditionLexer::advance() {
  skip_blanks();
  token_ = Token{TokenKind::kEnd, next_, {}, {}};
  if (rest().empty()) return;
  reject_foreign_operator();
  token_ = read_operator();
  if (token_.spelling.empty()) token_ = rest().starts_with('"') ? read_quoted() : read_word();
  next_ += token_.spelling.size();
}

void ConditionLexer::skip_blanks() {
  while (next_ < condition_.size() && shm::is_blank(condition_[next_])) ++next_;
}

void ConditionLexer::reject_foreign_operator() const {
  const auto reject = [this](std::string_view spelling, std::string_view advice) {
    if (!rest().starts_with(spelling)) return;
    throw ConditionError{next_, quote(spelling) + " is no operator here; " + std::string(advice)};
  };
  if (rest().starts_with("<->")) return;
  for (const auto& [spelling, advice] : kForeignOperators) reject(spelling, advice);
  if (language_ == Language::kStatement) {
    reject(kDoubleEquals, "write = behind winner(…), and iff between conditions");
    return;
  }
  reject(kDoubleEquals, "write iff");
  for (const auto& [spelling, advice] : kNoComparisons) reject(spelling, advice);
}

Token ConditionLexer::read_operator() const {
  if (language_ == Language::kStatement) {
    for (const auto& [spelling, kind] : kComparisons) {
      if (rest().starts_with(spelling)) return {kind, next_, spelling, {}};
    }
  }
  for (const auto& [spelling, kind] : kOperators) {
    if (rest().starts_with(spelling)) return {kind, next_, spelling, {}};
  }
  return {};
}

Token ConditionLexer::read_quoted() const {
  const std::size_t close = rest().find('"', 1);
  if (close == std::string_view::npos) {
    throw ConditionError{next_, "this quoted name does not end; close it with '\"'"};
  }
  const std::string_view name = rest().substr(1, close - 1);
  if (name.empty()) throw ConditionError{next_, "this name is empty; write one between the quotes"};
  return {TokenKind::kPort, next_, rest().substr(0, close + 1), name};
}

Token ConditionLexer::read_word() const {
  const std::string_view word = bare_name("");
  if (word.empty()) {
    const std::size_t length = shm::decode_utf8(rest()).length;
    const std::string where =
        language_ == Language::kStatement ? "in a statement" : "in a condition";
    throw ConditionError{next_, quote(rest().substr(0, length)) + " has no meaning " + where +
                                    "; " + advice_on(rest().front())};
  }
  if (word.starts_with('/')) return {TokenKind::kPort, next_, word, word};
  // Nothing but letters makes a keyword, so that not/a is understood.
  const std::string_view letters = word.substr(0, word.find('/'));
  for (const auto& [spelling, kind] : kWords) {
    if (spelling == letters) return {kind, next_, spelling, {}};
  }
  if (language_ == Language::kStatement) {
    for (const auto& [spelling, kind] : kStatementWords) {
      if (spelling == letters) return {kind, next_, spelling, {}};
    }
  }
  fail_at_word(next_, word, language_);
}

std::string_view ConditionLexer::bare_name(std::string_view more_characters) const {
  static constexpr std::string_view kPunctuation = "_.:/-";
  std::size_t length = 0;
  for (; length < rest().size(); ++length) {
    const char byte = rest()[length];
    if (rest().substr(length).starts_with("->")) break;  // an operator wherever it stands
    if (!is_letter_or_digit(byte) && kPunctuation.find(byte) == std::string_view::npos &&
        more_characters.find(byte) == std::string_view::npos) {
      break;
    }
  }
  return rest().substr(0, length);
}

}  // namespace arbiter::rules
