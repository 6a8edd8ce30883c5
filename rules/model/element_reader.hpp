// Strict access to the elements of a model file: what is unknown, missing or misplaced is reported.
#pragma once

#include <concepts>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "rules/model/model.hpp"
#include "rules/text/defines.hpp"
#include "rules/text/diagnostic.hpp"
#include "rules/text/text.hpp"
#include "rules/text/text_file.hpp"
#include "rules/text/xml.hpp"

namespace arbiter::rules {

using KnownNames = std::initializer_list<std::string_view>;

// What is empty has been reported, unless said otherwise.
class ElementReader {
 public:
  ElementReader(const TextFile& file, Defines& defines, Diagnostics& diagnostics)
      : file_(file), defines_(defines), diagnostics_(diagnostics) {}

  [[nodiscard]] Location where(const XmlNode& element) const { return locate(file_, element); }

  // Reports attributes that are not known, and those that occur twice.
  bool check_attributes(const XmlNode& element, KnownNames known);
  static bool has_attribute(const XmlNode& element, std::string_view name);
  // Of an attribute, decoded and expanded. Nothing is reported if it is absent.
  std::optional<Text> optional_attribute(const XmlNode& element, std::string_view name);
  std::optional<Text> attribute(const XmlNode& element, std::string_view name);

  // All the text of an element that has nothing but text.
  std::optional<Text> text(const XmlNode& element);
  // Text among elements means nothing, and nobody would read it.
  bool check_no_text(const XmlNode* first_child);
  void report_unknown_element(const XmlNode& element, KnownNames known);

  // A port's name, checked, as the whole of a text. `what` says whose, for the messages.
  std::optional<Mention> port_name(const Text& text, std::string_view what);
  std::optional<Mention> port_attribute(const XmlNode& element, std::string_view name);
  // The name of a behaviour or of a define, blanks collapsed.
  std::optional<Mention> name(const Text& text, std::string_view what);

  void error(std::string code, Location where, std::string message) {
    diagnostics_.error(std::move(code), std::move(where), std::move(message));
  }
  // `compose` returns the message; it is not called for what is only counted.
  template <std::invocable Compose>
  void error(const std::string& code, Location where, const Compose& compose) {
    const bool is_kept = diagnostics_.keeps_another(Severity::kError, code);
    diagnostics_.error(code, std::move(where), is_kept ? compose() : std::string());
  }

 private:
  const TextFile& file_;
  Defines& defines_;
  Diagnostics& diagnostics_;
};

// Whether there is nothing but blanks among siblings, and no element.
[[nodiscard]] bool is_blank(const XmlNode* first);

// The elements among siblings: for (const XmlNode& child : Elements(element.first_child)).
class Elements {
 public:
  explicit Elements(const XmlNode* first) : first_(first) {}

  class Iterator {
   public:
    explicit Iterator(const XmlNode* at) : at_(at) { skip_text(); }
    const XmlNode& operator*() const { return *at_; }
    Iterator& operator++() {
      at_ = at_->next;
      skip_text();
      return *this;
    }
    friend bool operator==(const Iterator&, const Iterator&) = default;

   private:
    void skip_text() {
      while (at_ != nullptr && at_->kind != XmlKind::kElement) at_ = at_->next;
    }
    const XmlNode* at_;
  };

  [[nodiscard]] Iterator begin() const { return Iterator(first_); }
  [[nodiscard]] Iterator end() const { return Iterator(nullptr); }

 private:
  const XmlNode* first_;
};

}  // namespace arbiter::rules
