"""Decision in, wheel speeds out: the controller of a differential drive. It knows neither MuJoCo nor the map."""
