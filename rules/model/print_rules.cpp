#include "rules/model/print_rules.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <string_view>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "rules/text/duration.hpp"

namespace arbiter::rules {
namespace {

// From the loosest to the tightest.
enum Precedence { kIff, kImplies, kOr, kXor, kAnd, kNot, kAtom };

Precedence precedence_of(const Expression& expression) {
  switch (expression.op) {
    case Operator::kIff:
      return kIff;
    case Operator::kImplies:
      return kImplies;
    case Operator::kOr:
      return expression.operands.size() > 1 ? kOr : kAtom;
    case Operator::kXor:
      return kXor;
    case Operator::kAnd:
      return expression.operands.size() > 1 ? kAnd : kAtom;
    case Operator::kNot:
      return kNot;
    default:
      return kAtom;
  }
}

// A name that a condition takes without quotes. (No name holds a quote itself.)
std::string to_word(std::string_view name) {
  const auto is_plain = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
           std::string_view("_.:/-").find(c) != std::string_view::npos;
  };
  if (name.starts_with('/') && std::all_of(name.begin(), name.end(), is_plain)) {
    return std::string(name);
  }
  return '"' + std::string(name) + '"';
}

void print(std::string& text, const Expression& expression, Precedence at_least);

void print_joined(std::string& text, const Expression& expression, std::string_view sign,
                  Precedence at_least) {
  const char* separator = "";
  for (const auto& operand : expression.operands) {
    text += separator;
    // Operands of the same kind are joined alike, parentheses or not.
    print(text, *operand, at_least);
    separator = sign.data();
  }
}

void print_binary(std::string& text, const Expression& expression, std::string_view sign,
                  Precedence left, Precedence right) {
  print(text, *expression.operands[0], left);
  text += sign;
  print(text, *expression.operands[1], right);
}

void print_quantifier(std::string& text, const Expression& expression, std::string_view word) {
  text += std::string(word) + '(' + expression.name + ')';
}

void print_operation(std::string& text, const Expression& expression) {
  switch (expression.op) {
    case Operator::kFalse:
      text += "false";
      break;
    case Operator::kTrue:
      text += "true";
      break;
    case Operator::kSource:
      text += to_word(expression.name);
      break;
    case Operator::kNot:
      text += "¬";
      print(text, *expression.operands[0], kNot);
      break;
    case Operator::kAnd:
      if (expression.operands.empty()) text += "true";
      print_joined(text, expression, " ∧ ", kAnd);
      break;
    case Operator::kOr:
      if (expression.operands.empty()) text += "false";
      print_joined(text, expression, " ∨ ", kOr);
      break;
    case Operator::kXor:
      print_binary(text, expression, " xor ", kXor, kAnd);
      break;
    case Operator::kImplies:
      print_binary(text, expression, " → ", kOr, kImplies);
      break;
    case Operator::kIff:
      print_binary(text, expression, " ↔ ", kIff, kImplies);
      break;
    case Operator::kAny:
      print_quantifier(text, expression, "any");
      break;
    case Operator::kAll:
      print_quantifier(text, expression, "all");
      break;
    case Operator::kNone:
      print_quantifier(text, expression, "none");
      break;
  }
}

// Parentheses go around what binds more loosely than its place asks for.
void print(std::string& text, const Expression& expression, Precedence at_least) {
  const bool is_single = (expression.op == Operator::kAnd || expression.op == Operator::kOr) &&
                         expression.operands.size() == 1;
  if (is_single) return print(text, *expression.operands[0], at_least);
  const bool parentheses = precedence_of(expression) < at_least;
  if (parentheses) text += '(';
  print_operation(text, expression);
  if (parentheses) text += ')';
}

void collect_conjuncts(const Expression& expression, std::vector<std::string>& conjuncts) {
  if (expression.op == Operator::kAnd) {
    for (const auto& operand : expression.operands) collect_conjuncts(*operand, conjuncts);
  } else if (expression.op != Operator::kTrue) {
    std::string text;
    print(text, expression, kAnd);
    conjuncts.push_back(std::move(text));
  }
}

std::map<std::string, std::vector<std::string>> unselected_sources(const RuleSet& rules) {
  std::map<std::string, std::vector<std::string>> result;
  for (const auto& connection : rules.other_connections) {
    result[connection.port].push_back(connection.source);
  }
  return result;
}

// All ports, in byte order; a null pointer where no rule mentions the port.
std::map<std::string, const PortRules*> all_ports(const RuleSet& rules) {
  std::map<std::string, const PortRules*> ports;
  for (const auto& connection : rules.other_connections) ports.emplace(connection.port, nullptr);
  for (const auto& port : rules.ports) ports[port.port] = &port;
  return ports;
}

}  // namespace

std::string to_string(const Expression& expression) {
  std::string text;
  print(text, expression, kIff);
  return text;
}

std::string to_string(const ConnectionRule& rule) {
  std::string text = to_word(rule.source);
  std::vector<std::string> conjuncts;
  collect_conjuncts(*rule.condition, conjuncts);
  std::set<std::string> said{text};
  for (const auto& conjunct : conjuncts) {
    if (said.insert(conjunct).second) text += " ∧ " + conjunct;
  }
  return text;
}

void write_rules(std::ostream& out, const RuleSet& rules) {
  auto unselected = unselected_sources(rules);
  for (const auto& [name, port] : all_ports(rules)) {
    out << name;
    if (port == nullptr) out << "  (no rule: delivers everything)";
    if (port != nullptr && port->first_wins) out << "  (conflict=\"first\": the first that holds)";
    out << '\n';
    if (port != nullptr) {
      for (const auto& rule : port->rules) {
        out << "  " << to_string(rule) << " ⇒ Select(" << to_word(rule.source) << ")\n";
      }
    }
    for (const auto& source : unselected[name]) {
      out << "  " << to_word(source) << (port == nullptr ? "\n" : "  (no rule: never delivers)\n");
    }
  }
}

void write_rules_json(std::ostream& out, const RuleSet& rules) {
  using Json = nlohmann::ordered_json;
  std::map<std::pair<std::string, std::string>, std::vector<std::string>> behaviours;
  for (const auto& behaviour : rules.behaviours) {
    for (const auto& [port, rule] : behaviour.rules) {
      behaviours[{port, rule.source}].push_back(behaviour.name);
    }
  }
  Json ports = Json::array();
  auto unselected = unselected_sources(rules);
  for (const auto& [name, port] : all_ports(rules)) {
    Json connections = Json::array();
    if (port != nullptr) {
      for (const auto& rule : port->rules) {
        connections.push_back({{"source", rule.source},
                               {"rule", to_string(rule)},
                               {"behaviours", behaviours[{name, rule.source}]}});
      }
    }
    for (const auto& source : unselected[name]) {
      connections.push_back({{"source", source}, {"rule", nullptr}, {"behaviours", Json::array()}});
    }
    const bool first_wins = port != nullptr && port->first_wins;
    ports.push_back({{"port", name},
                     {"arbitrated", port != nullptr},
                     {"conflict", first_wins ? "first" : "error"},
                     {"connections", std::move(connections)}});
  }
  Json timeouts = Json::object();
  for (const auto& [source, timeout] : rules.timeouts) timeouts[source] = to_string(timeout);
  const Json all = {{"timeout", to_string(rules.timeout)},
                    {"timeouts", std::move(timeouts)},
                    {"ports", std::move(ports)}};
  out << all.dump(2, ' ', false, Json::error_handler_t::replace) << '\n';
}

}  // namespace arbiter::rules
