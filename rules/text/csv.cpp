#include "rules/text/csv.hpp"

#include <utility>

#include "shm/utf8.hpp"

namespace arbiter::rules {

bool CsvReader::at_line_end() const {
  return at_ == text_.size() || text_[at_] == '\n' || text_.substr(at_, 2) == "\r\n";
}

void CsvReader::skip_line_end() {
  if (at_ < text_.size() && text_[at_] == '\r') ++at_;
  if (at_ < text_.size()) ++at_;
}

bool CsvReader::skip_blank_line() {
  std::size_t end = at_;
  while (end < text_.size() && text_[end] != '\n' && shm::is_blank(text_[end])) ++end;
  if (end < text_.size() && text_[end] != '\n') return false;
  at_ = end == text_.size() ? end : end + 1;
  return true;
}

bool CsvReader::fail(std::size_t offset, std::string message) {
  diagnostics_.error("malformed-csv", file_.locate(offset), std::move(message));
  const std::size_t line_end = text_.find('\n', at_);
  at_ = line_end == std::string_view::npos ? text_.size() : line_end + 1;
  return false;
}

std::optional<CsvRecord> CsvReader::next() {
  while (at_ < text_.size()) {
    if (skip_blank_line()) continue;
    CsvRecord record;
    bool more = true;
    while (more) {
      record.emplace_back();
      if (!read_field(record.back())) {
        record.clear();
        break;
      }
      more = at_ < text_.size() && text_[at_] == ',';
      if (more) ++at_;
    }
    if (record.empty()) continue;
    skip_line_end();
    return record;
  }
  return std::nullopt;
}

// Leaves the reader at the comma or the line's end behind the field.
bool CsvReader::read_field(CsvField& field) {
  field.offset = at_;
  if (at_ < text_.size() && text_[at_] == '"') return read_quoted(field);
  while (!at_line_end() && text_[at_] != ',') {
    if (text_[at_] == '"') {
      return fail(at_,
                  "a quote inside a field that does not begin with one; put the whole field in "
                  "quotes, and double the quotes inside");
    }
    field.value += text_[at_++];
  }
  return true;
}

bool CsvReader::read_quoted(CsvField& field) {
  const std::size_t opening = at_++;
  while (at_ < text_.size()) {
    const char c = text_[at_++];
    if (c != '"') {
      field.value += c;
    } else if (at_ < text_.size() && text_[at_] == '"') {
      field.value += text_[at_++];
    } else if (at_line_end() || text_[at_] == ',') {
      return true;
    } else {
      return fail(at_, "only a comma or the end of the line may follow a closing quote");
    }
  }
  return fail(opening, "this quote is never closed; end the field with another one");
}

std::string to_csv(std::string_view value) {
  if (value.find_first_of(",\"\r\n") == std::string_view::npos) return std::string(value);
  std::string quoted = "\"";
  for (const char c : value) {
    if (c == '"') quoted += '"';
    quoted += c;
  }
  return quoted + '"';
}

}  // namespace arbiter::rules
