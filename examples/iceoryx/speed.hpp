// What the commanders send and the base obeys.
#pragma once

struct Speed {
  double forward = 0;  // m/s
  double turn = 0;     // rad/s
};
