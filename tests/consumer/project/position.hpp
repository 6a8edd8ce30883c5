#pragma once

#include <cstdio>
#include <cstdlib>

struct Position {
  double x, y, z;
};

inline void require(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "not so: %s\n", what);
  std::exit(1);
}
