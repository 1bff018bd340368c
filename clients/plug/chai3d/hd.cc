// SPDX-License-Identifier: Apache-2.0
// libHD.so: CHAI3D opens it before libhdPhantom.so and asks it for nothing.
