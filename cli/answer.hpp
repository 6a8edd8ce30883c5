// Verbs whose exit code 1 is an answer: models differ, there are findings, a file is not whole.
#pragma once

#include <exception>
#include <iostream>

#include <CLI/CLI.hpp>

#include "shm/utf8.hpp"

namespace arbiter::cli {

// The exit code of such a verb; where something keeps it from its answer, says what, and 2.
template <class Verb>
int or_cannot_tell(const Verb& verb) {
  try {
    return verb();
  } catch (const CLI::ParseError&) {
    throw;  // main() has words for wrong use
  } catch (const std::exception& error) {
    std::cerr << "arbiter: " << shm::printable(error.what(), "\n\t") << '\n';
    return 2;
  }
}

}  // namespace arbiter::cli
