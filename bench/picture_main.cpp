// bench-picture: draws a report's picture again, without measuring anything.
#include <exception>
#include <fstream>
#include <iostream>

#include <nlohmann/json.hpp>

#include "bench/harness/picture.hpp"

int main(int argc, char** argv) {
  if (argc != 3) {
    std::cerr << "Usage: bench-picture REPORT.json PICTURE.svg\n";
    return 2;
  }
  try {
    std::ifstream in(argv[1]);
    if (!in) throw std::runtime_error(std::string("cannot read ") + argv[1]);
    const std::string picture = arbiter::bench::picture(nlohmann::json::parse(in));
    std::ofstream out(argv[2]);
    if (!(out << picture << std::flush))
      throw std::runtime_error(std::string("cannot write ") + argv[2]);
  } catch (const std::exception& error) {
    std::cerr << "bench-picture: " << error.what() << '\n';
    return 1;
  }
  return 0;
}
