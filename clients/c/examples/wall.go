// SPDX-License-Identifier: Apache-2.0
package main // A wall of 2000 N/m at x = 0: go run wall.go SERVER

// #cgo LDFLAGS: -ltendon
// #include <tendon.h>
import "C"
import ("fmt"; "os")

func main() {
	why := [200]C.char{}
	config := C.tendon_config{size: C.sizeof_tendon_config, server: C.CString(os.Args[1]), name: C.CString("wall.go")}
	client := C.tendon_open(&config, &why[0], 200)
	if client == nil { fmt.Println("wall:", C.GoString(&why[0])); os.Exit(1) }
	hand := C.tendon_state{size: C.sizeof_tendon_state}
	wall := C.tendon_force{size: C.sizeof_tendon_force, has: C.TENDON_FORCE_STIFFNESS}
	for i := 0; i < 1500 && C.tendon_wait(client, &hand, 1e9) == C.TENDON_OK; i++ {
		wall.tick, wall.stiffness[0] = hand.tick, 0
		if hand.position[0] > 0 { wall.stiffness[0] = 2000 }
		wall.force[0] = -wall.stiffness[0] * hand.position[0]
		C.tendon_send(client, &wall)
	}
	fmt.Printf("x %.2f mm, %.2f N on the hand\n", 1e3*float64(hand.position[0]), float64(hand.force_applied[0]))
	C.tendon_close(client)
}
