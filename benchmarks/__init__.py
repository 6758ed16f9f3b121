"""Speed, measured: `./dev.sh bench [NAME...]`."""
