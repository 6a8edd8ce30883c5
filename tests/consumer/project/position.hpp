#pragma once

#include <cstdio>
#include <cstdlib>

#include <arbiter/type.hpp>

struct Position {
  double x, y, z;
};
ARBITER_TYPE(Position, "geometry/Position");

inline void require(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "not so: %s\n", what);
  std::exit(1);
}
