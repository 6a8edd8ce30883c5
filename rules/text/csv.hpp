// Comma-separated values (RFC 4180), read so that each field knows its place, and written.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "rules/text/diagnostic.hpp"
#include "rules/text/text_file.hpp"

namespace arbiter::rules {

struct CsvField {
  std::string value;
  std::size_t offset = 0;  // in the file
};
using CsvRecord = std::vector<CsvField>;  // at least one field

// Skips blank lines; takes LF and CRLF. Reports what is not CSV, and carries on behind that line.
class CsvReader {
 public:
  CsvReader(const TextFile& file, Diagnostics& diagnostics)
      : file_(file), text_(file.content()), diagnostics_(diagnostics) {}

  std::optional<CsvRecord> next();  // nothing at the end

 private:
  bool skip_blank_line();
  bool read_field(CsvField& field);
  bool read_quoted(CsvField& field);
  [[nodiscard]] bool at_line_end() const;
  void skip_line_end();
  bool fail(std::size_t offset, std::string message);

  const TextFile& file_;
  std::string_view text_;
  Diagnostics& diagnostics_;
  std::size_t at_ = 0;
};

// As a field: in quotes if it needs them.
std::string to_csv(std::string_view value);

}  // namespace arbiter::rules
