% SPDX-License-Identifier: Apache-2.0
% A wall of 2000 N/m at x = 0: octave-cli wall.m SERVER
rows = tendon_oct(argv(){1}, 1500, @(x) (x(1) > 0) * 2000 * [-x(1); 0; 0; 1; 0; 0]);
printf("x %.2f mm, %.2f N on the hand\n", 1e3 * rows(end, 1), rows(end, 4));
