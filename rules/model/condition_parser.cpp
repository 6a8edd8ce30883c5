#include "rules/model/condition_parser.hpp"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "rules/model/condition_lexer.hpp"
#include "rules/text/names.hpp"

namespace arbiter::rules {
namespace {

struct Parsed {
  ExpressionPtr expression;
  int depth = 1;
};

// How tightly a binary operator binds; -1 for what is none.
int level_of(TokenKind kind) {
  switch (kind) {
    case TokenKind::kIff:
      return 0;
    case TokenKind::kImplies:
      return 1;
    case TokenKind::kOr:
      return 2;
    case TokenKind::kXor:
      return 3;
    case TokenKind::kAnd:
      return 4;
    default:
      return -1;
  }
}

Operator operator_of(TokenKind kind) {
  switch (kind) {
    case TokenKind::kIff:
      return Operator::kIff;
    case TokenKind::kImplies:
      return Operator::kImplies;
    case TokenKind::kOr:
      return Operator::kOr;
    case TokenKind::kXor:
      return Operator::kXor;
    case TokenKind::kAny:
      return Operator::kAny;
    case TokenKind::kAll:
      return Operator::kAll;
    case TokenKind::kNone:
      return Operator::kNone;
    default:
      return Operator::kAnd;
  }
}

class Parser {
 public:
  Parser(const Text& text, std::vector<Mention>* sources, std::vector<Mention>* globs)
      : text_(text), sources_(sources), globs_(globs), lexer_(text.bytes()) {}
  Parser(const Text& text, ParsedStatement& statement)
      : text_(text),
        statement_(&statement),
        sources_(&statement.sources),
        globs_(&statement.globs),
        lexer_(text.bytes(), Language::kStatement) {}

  ExpressionPtr parse_all() {
    Parsed parsed = parse_binary(0);
    const Token& next = lexer_.peek();
    if (next.kind == TokenKind::kClose) fail(next.at, "this ')' closes nothing; remove it");
    if (next.kind == TokenKind::kEquals || next.kind == TokenKind::kDiffers) {
      fail(next.at, quote(next.spelling) +
                        " compares a winner, as in winner(/Arm/pos:i) = /Teleop/pos:o; between "
                        "conditions write " +
                        (next.kind == TokenKind::kEquals ? "iff" : "xor"));
    }
    if (next.kind != TokenKind::kEnd) {
      fail(next.at, "an operator is missing before " + quote(next.spelling) +
                        "; write and, or, xor, implies or iff");
    }
    return std::move(parsed.expression);
  }

 private:
  // A term and all that follows it with operators of this level or tighter ones.
  Parsed parse_binary(int level) {
    Parsed left = parse_unary();
    while (level_of(lexer_.peek().kind) >= level) {
      const Token op = lexer_.take();
      const int tighter = level_of(op.kind) + 1;
      std::vector<Parsed> operands{std::move(left)};
      if (op.kind == TokenKind::kImplies) {
        const Nesting nesting(*this, op.at);
        operands.push_back(parse_binary(tighter - 1));
      } else {
        operands.push_back(parse_binary(tighter));
      }
      const bool takes_more = op.kind == TokenKind::kAnd || op.kind == TokenKind::kOr;
      while (takes_more && lexer_.peek().kind == op.kind) {
        lexer_.take();
        operands.push_back(parse_binary(tighter));
      }
      left = combine(operator_of(op.kind), std::move(operands), op.at);
    }
    return left;
  }

  Parsed parse_unary() {
    std::vector<Token> nots;
    while (lexer_.peek().kind == TokenKind::kNot) nots.push_back(lexer_.take());
    Parsed operand = parse_operand();
    for (; !nots.empty(); nots.pop_back()) {
      std::vector<Parsed> operands{std::move(operand)};
      operand = combine(Operator::kNot, std::move(operands), nots.back().at);
    }
    return operand;
  }

  Parsed parse_operand() {
    const Token token = lexer_.peek();
    switch (token.kind) {
      case TokenKind::kTrue:
      case TokenKind::kFalse:
        lexer_.take();
        return {make_constant(token.kind == TokenKind::kTrue)};
      case TokenKind::kPort:
        check_port(token);
        lexer_.take();
        if (sources_ != nullptr) sources_->push_back(mention(token));
        return {make_source(std::string(token.name))};
      case TokenKind::kOpen: {
        lexer_.take();
        const Nesting nesting(*this, token.at);
        Parsed inside = parse_binary(0);
        expect_close(token);
        return inside;
      }
      case TokenKind::kAny:
      case TokenKind::kAll:
      case TokenKind::kNone:
        return parse_quantifier();
      case TokenKind::kWinner:
      case TokenKind::kIdle:
        return parse_winner();
      case TokenKind::kActive:
        return parse_active();
      default:
        break;
    }
    const std::string expected =
        " where a port's name, true, false, a quantifier or '(' is expected; write one";
    if (token.kind == TokenKind::kEnd) {
      fail(token.at,
           (statement_ != nullptr ? "the statement ends" : "the condition ends") + expected);
    }
    fail(token.at, quote(token.spelling) + " stands" + expected + " before it");
  }

  Parsed parse_quantifier() {
    const Token quantifier = lexer_.take();
    Mention glob = take_pattern(quantifier);
    ExpressionPtr expression = make_quantifier(operator_of(quantifier.kind), glob.name);
    if (globs_ != nullptr) globs_->push_back(std::move(glob));
    return {std::move(expression)};
  }

  // "active(/Deadman:o)" says the same as the name alone, beside winner(…) and idle(…).
  Parsed parse_active() {
    const std::string example = "active(/Deadman:o)";
    lexer_.take();
    const Token open = lexer_.peek();
    if (open.kind != TokenKind::kOpen) {
      fail(open.at, "active takes a source in parentheses; write " + example +
                        ", or the source's name alone");
    }
    lexer_.take();
    Mention source = take_port("a source's name, as in " + example);
    expect_close(open);
    ExpressionPtr expression = make_source(source.name);
    sources_->push_back(std::move(source));
    return {std::move(expression)};
  }

  Parsed parse_winner() {
    const Token word = lexer_.take();
    const std::string example =
        word.kind == TokenKind::kIdle ? "idle(/Arm/pos:i)" : "winner(/Arm/pos:i) = /Teleop/pos:o";
    const Token open = lexer_.peek();
    if (open.kind != TokenKind::kOpen) {
      fail(open.at, std::string(word.spelling) + " takes a port in parentheses; write " + example);
    }
    lexer_.take();
    WinnerTerm term{take_port("an input port's name, as in " + example), {}};
    expect_close(open);
    bool differs = false;
    if (word.kind == TokenKind::kWinner) {
      const Token comparison = lexer_.peek();
      differs = comparison.kind == TokenKind::kDiffers;
      if (!differs && comparison.kind != TokenKind::kEquals) {
        fail(comparison.at,
             "'=' or '!=' is missing behind winner(" + term.port.name + "); write " + example);
      }
      lexer_.take();
      parse_who(term, example);
    }
    ExpressionPtr expression = make_source(term_name(statement_->terms.size()));
    statement_->terms.push_back(std::move(term));
    if (!differs) return {expression};
    return {make_operation(Operator::kNot, {std::move(expression)}), 2};
  }

  // What stands behind "winner(/p) =".
  void parse_who(WinnerTerm& term, const std::string& example) {
    const Token who = lexer_.peek();
    switch (who.kind) {
      case TokenKind::kNone:
        lexer_.take();
        if (lexer_.peek().kind != TokenKind::kOpen) return;
        fail(who.at,
             "none means that nobody wins; for the winner to be none of several sources, "
             "write winner(" +
                 term.port.name + ") != any(/Nav/*)");
      case TokenKind::kAll:
        fail(who.at, "only one source wins at a port; write any(/Nav/*) for one of several");
      case TokenKind::kAny:
        lexer_.take();
        term.pattern = take_pattern(who);
        return;
      case TokenKind::kWinner: {
        lexer_.take();
        const Token open = lexer_.peek();
        if (open.kind != TokenKind::kOpen) {
          fail(open.at, "winner takes a port in parentheses; write winner(/Arm/pos:i)");
        }
        lexer_.take();
        term.other_port = take_port("an input port's name, as in winner(/Arm/pos:i)");
        expect_close(open);
        return;
      }
      default:
        term.source = take_port("a source, any(…), winner(…) or none here, as in " + example);
    }
  }

  // "(GLOB)".
  Mention take_pattern(const Token& quantifier) {
    const Token open = lexer_.peek();
    const std::string word(quantifier.spelling);
    if (open.kind != TokenKind::kOpen) {
      fail(open.at, word + " takes a pattern in parentheses; write " + word + "(/Face/*)");
    }
    const Token glob = lexer_.take_glob();
    expect_close(open);
    return mention(glob);
  }

  Mention take_port(const std::string& expected) {
    const Token token = lexer_.peek();
    if (token.kind != TokenKind::kPort) fail(token.at, "expected " + expected);
    check_port(token);
    lexer_.take();
    return mention(token);
  }

  [[nodiscard]] Mention mention(const Token& token) const {
    return {std::string(token.name), text_.where(token.at),
            text_.define_of(token.at, token.at + token.spelling.size())};
  }

  void expect_close(const Token& open) {
    const Token& next = lexer_.peek();
    if (next.kind == TokenKind::kClose) {
      lexer_.take();
    } else if (next.kind == TokenKind::kEnd) {
      fail(open.at, "this '(' is not closed; write ')' where it ends");
    } else {
      fail(next.at, "an operator, or the ')' of " + describe(text_.where(open.at)) +
                        ", is missing before " + quote(next.spelling));
    }
  }

  void check_port(const Token& token) const {
    if (auto problem = find_problem_in_port(token.name)) {
      const std::size_t quote_mark = token.spelling.size() == token.name.size() ? 0 : 1;
      throw ConditionError{token.at + quote_mark + problem->at, problem->message, problem->code};
    }
  }

  [[nodiscard]] Parsed combine(Operator op, std::vector<Parsed> operands, std::size_t at) const {
    int depth = 0;
    std::vector<ExpressionPtr> expressions;
    for (Parsed& operand : operands) {
      depth = std::max(depth, operand.depth);
      expressions.push_back(std::move(operand.expression));
    }
    check_depth(depth + 1, at);
    return {make_operation(op, std::move(expressions)), depth + 1};
  }

  // Counts the calls of this parser that are inside each other.
  class Nesting {
   public:
    Nesting(Parser& parser, std::size_t at) : parser_(parser) {
      parser_.check_depth(++parser_.nesting_, at);
    }
    ~Nesting() { --parser_.nesting_; }
    Nesting(const Nesting&) = delete;
    Nesting& operator=(const Nesting&) = delete;

   private:
    Parser& parser_;
  };

  static void check_depth(int depth, std::size_t at) {
    if (depth <= kMaxConditionDepth) return;
    throw ConditionError{at,
                         "the condition is nested deeper than the limit of " +
                             std::to_string(kMaxConditionDepth) + "; simplify it",
                         "limit-exceeded"};
  }

  [[noreturn]] static void fail(std::size_t at, std::string message) {
    throw ConditionError{at, std::move(message)};
  }

  const Text& text_;
  ParsedStatement* statement_ = nullptr;     // none while a condition is parsed
  std::vector<Mention>* sources_ = nullptr;  // none where nobody asks, as with the next
  std::vector<Mention>* globs_ = nullptr;
  ConditionLexer lexer_;
  int nesting_ = 0;
};

void report(ConditionError& error, const Text& text, Diagnostics& diagnostics) {
  diagnostics.error(std::move(error.code), text.where(error.at),
                    std::move(error.message) + text.origin(error.at));
}

}  // namespace

std::optional<ExpressionPtr> parse_condition(const Text& text, Diagnostics& diagnostics,
                                             std::vector<Mention>* sources,
                                             std::vector<Mention>* globs) {
  try {
    return Parser(text, sources, globs).parse_all();
  } catch (ConditionError& error) {
    report(error, text, diagnostics);
    return {};
  }
}

std::optional<ParsedStatement> parse_statement(const Text& text, Diagnostics& diagnostics) {
  try {
    ParsedStatement statement;
    statement.expression = Parser(text, statement).parse_all();
    return statement;
  } catch (ConditionError& error) {
    if (error.code == "malformed-condition") error.code = "malformed-statement";
    report(error, text, diagnostics);
    return {};
  }
}

}  // namespace arbiter::rules
