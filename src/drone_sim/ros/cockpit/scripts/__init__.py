"""The scripts: kept, edited, flown where their texts say, graded."""
